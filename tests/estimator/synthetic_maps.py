"""Disparity maps whose roll is known, or that have none."""

import math

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from rollcli.estimator.energy import Energy, Terms
from rollcli.estimator.moments import map_moments

# the same examples each time, however busy the machine
repeatable = settings(derandomize=True, max_examples=60, database=None)


def flat_road(roll_deg, *, width=160, height=120, focal=140.0, pitch_deg=8.0, dtype=np.float64):
    """Exact disparity of a flat road seen by a rolled and pitched rig; 0 above the horizon.

    The road's normal, in the camera's frame, is turned by the roll about the optical axis; depth along a
    ray is height / (normal . ray), and disparity focal * baseline / depth.
    """
    roll, pitch = math.radians(roll_deg), math.radians(pitch_deg)
    normal = np.array([-math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch), math.sin(pitch)])
    v, u = np.mgrid[:height, :width]
    ray = np.stack([(u - (width - 1) / 2) / focal, (v - (height - 1) / 2) / focal, np.ones(u.shape)])
    baseline, camera_height = 0.3, 1.4
    inverse_depth = np.tensordot(normal, ray, axes=1) / camera_height
    return np.maximum(focal * baseline * inverse_depth, 0).astype(dtype)


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
    return Energy.of(map_moments(disparity), float(np.nanmax(disparity)), **options)


def degrees_apart(one, other):
    """How far two angles (radians) are apart, as rotations of rows."""
    return math.degrees(abs(math.remainder(one - other, math.pi)))


def at_each(energy, thetas):
    """The energy at many angles: each of its terms an array shaped like them."""
    return Terms(*np.array([energy.at(theta) for theta in thetas.tolist()]).T)
