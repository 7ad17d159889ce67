"""Disparity maps whose roll is known, or that have none."""

import math

import numpy as np
from hypothesis import strategies as st

from rollcli.estimator.energy import Energy, Terms
from rollcli.estimator.moments import map_moments
from rollcli.rig.calibration import Calibration


def turned(roll, pitch):
    """Axes of the camera (rows: right, down, forward) in a world of X right, Y down, Z forward."""
    level = np.array(
        [[1, 0, 0], [0, math.cos(pitch), -math.sin(pitch)], [0, math.sin(pitch), math.cos(pitch)]]
    )
    # a rig turned counter-clockwise seen from behind: its right axis goes up
    own = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    return own @ level


def cast(calibration, roll, pitch, height, shape=(200, 320)):
    """Disparity of a level road by casting the ray of each pixel; 0 above the horizon."""
    v, u = np.mgrid[: shape[0], : shape[1]].astype(float)
    rays = np.stack(
        [(u - calibration.cx) / calibration.fx, (v - calibration.cy) / calibration.fy, np.ones_like(u)], -1
    )
    down = (rays @ turned(roll, pitch))[..., 1]
    with np.errstate(divide="ignore"):
        depth = np.where(down > 1e-9, height / down, np.inf)
    disparity = calibration.fx * calibration.baseline / depth - calibration.doffs
    return np.where((disparity > 0) & np.isfinite(depth), disparity, 0)


def flat_road(roll_deg, *, width=160, height=120, focal=140.0, pitch_deg=8.0, dtype=np.float64):
    """Exact disparity of a flat road seen by a rolled and pitched rig 1.4 m above it; 0 above the horizon."""
    rig = Calibration(focal, focal, (width - 1) / 2, (height - 1) / 2, baseline=0.3)
    road = cast(rig, math.radians(roll_deg), math.radians(pitch_deg), 1.4, (height, width))
    return road.astype(dtype)


def bent_road(roll_deg, *, width=160, height=120, bend=0.002, noise=0.0, seed=0):
    """A road whose disparity is a parabola in y, with noise, in pixels."""
    roll = math.radians(roll_deg)
    v, u = np.mgrid[:height, :width] - np.array([(height - 1) / 2, (width - 1) / 2])[:, None, None]
    y = v * math.cos(roll) - u * math.sin(roll)
    rng = np.random.default_rng(seed)
    return 80 + 0.3 * y + bend * y * y + rng.normal(0, noise, y.shape)


def banked_road(roll_deg, *, cropped=0, middle=310):
    """A level lane, noise, and ground that rises to its right; so many columns on the left are cropped."""
    roll, slope = math.radians(roll_deg), 0.33
    v, u = np.mgrid[:190, :620] - np.array([94, middle])[:, None, None]
    road = 5 + slope * (v * math.cos(roll) - u * math.sin(roll))
    side = slope * (u * math.cos(roll) + v * math.sin(roll)) / np.maximum(road, 1)
    noisy = road / (1 - 0.06 * np.clip(side - 1.3, 0, 8)) + np.random.default_rng(0).normal(0, 0.1, v.shape)
    return np.where(road > 1, noisy, 0)[:, cropped:]


@st.composite
def random_maps(draw):
    """Noise, whole pixels, roads at any roll, few pixels, strips: of any small size."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    height, width = draw(st.integers(6, 50)), draw(st.integers(6, 50))
    kind = draw(st.sampled_from(["noise", "steps", "road", "sparse", "strip", "symmetric"]))
    noise = rng.uniform(1, 9, (height, width))
    if kind == "steps":
        return rng.integers(1, 5, (height, width)).astype(float)
    if kind == "road":
        sigma = draw(st.sampled_from([0.001, 0.1, 3]))
        roll = draw(st.floats(-90, 90))
        return bent_road(roll, width=width, height=height, noise=sigma, seed=int(rng.integers(99)))
    if kind == "sparse":
        return noise * (rng.random(noise.shape) < 0.5)
    if kind == "strip":
        v, u = np.mgrid[:height, :width]
        return noise * (np.abs(u * height - v * width) < 2.5 * max(height, width))
    if kind == "symmetric":
        return noise + noise[:, ::-1]
    return noise


def energy_of(disparity, **options):
    """The energy over all valid pixels of a map."""
    return Energy.of(map_moments(disparity), **options)


def degrees_apart(one, other):
    """How far two angles (radians) are apart, as rotations of rows."""
    return math.degrees(abs(math.remainder(one - other, math.pi)))


def at_each(energy, thetas):
    """The energy at many angles: each of its terms an array shaped like them."""
    return Terms(*np.array([energy.at(theta) for theta in thetas.tolist()]).T)
