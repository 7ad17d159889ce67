"""Roads with a cross section: each pixel shows the point that an independent march along its ray finds."""

import csv
import math

import numpy as np
import pytest

from rollcli.simulate.build import build_scene, carriageway_of
from rollcli.simulate.dataset import truth_csv
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import Ground
from tests.slow import mostly_slow
from tests.true_disparity import true_disparity

SMALL = {"size": (320, 240), "focal": 186.0, "crossfall": 0.04}
SHAPES = ("crown", "roof", "dish", "superelevated")
BENT, STRAIGHT = 4, 2  # seeds of an open road


def road_height(spec, road, lateral):
    """Elevation of the carriageway, written down per shape; 0 at lateral 0."""

    def profile(x):
        from_middle = x - (road.left + road.right) / 2
        half, fall = (road.right - road.left) / 2, spec.crossfall
        # measured in the gutter from its inner edge
        inner = np.clip(from_middle, -half + 0.35, half - 0.35) if spec.gutter else from_middle
        beyond = np.abs(from_middle) - np.abs(inner)
        rising = 1.0 if road.course.bend < 0 else -1.0
        height, steepness = {
            "flat": (0.0 * inner, 0.0),
            "crown": (-fall * inner**2 / (2 * half), -fall * inner / half),
            "dish": (fall * inner**2 / (2 * half), fall * inner / half),
            "roof": (-fall * np.abs(inner), -fall * np.sign(inner)),
            "superelevated": (rising * fall * inner, rising * fall),
        }[spec.cross_section]
        return height + beyond * (steepness * np.sign(from_middle) - spec.gutter)

    return profile(lateral) - profile(np.zeros(1))


def camera_in_world(spec, road):
    """Columns: the camera's right, down and forward axes; and its position."""
    slope = float((road_height(spec, road, np.array([1e-6])) - road_height(spec, road, np.array([-1e-6])))[0])
    slope /= 2e-6
    right = np.array([1.0, slope, 0.0]) / math.hypot(1.0, slope)
    up = np.array([-slope, 1.0, slope * road.course.heading])
    up /= np.linalg.norm(up)
    ahead = np.cross(right, up)
    cos_p, sin_p, cos_r, sin_r = (f(a) for a in (spec.pitch, spec.roll) for f in (math.cos, math.sin))
    forward, level_down = cos_p * ahead - sin_p * up, -sin_p * ahead - cos_p * up
    axes = np.stack([cos_r * right - sin_r * level_down, sin_r * right + cos_r * level_down, forward], axis=1)
    return axes, spec.height * up


def height_over_road(spec, road, points):
    """Of world points (..., 3), measured upward; and the lateral position."""
    x, y, z = np.moveaxis(points, -1, 0)
    lateral = x - road.course.heading * z - road.course.bend / 2 * z**2
    return y - spec.curvature / 2 * z**2 - road_height(spec, road, lateral), lateral


def marched_disparity(spec, road, u, v):
    """f B / depth of the first point at which a ray comes below the road; nan where none is found."""
    axes, place = camera_in_world(spec, road)
    x, y = ((at - (size - 1) / 2) / spec.focal for at, size in zip((u, v), spec.size, strict=True))
    rays = np.stack([x, y, np.ones_like(x)], axis=1) @ axes.T
    steps = np.arange(0.1, 45, 0.02)
    over, lateral = height_over_road(spec, road, place + steps[:, None, None] * rays)
    met = (over <= 0) & (lateral > road.left) & (lateral < road.right)
    first = np.argmax(met, axis=0)
    low, high = steps[first] - 0.02, steps[first]
    for _ in range(60):
        middle = (low + high) / 2
        above = height_over_road(spec, road, place + middle[:, None] * rays)[0] > 0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.where(met.any(axis=0), spec.focal * spec.baseline / low, np.nan)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("gutter", mostly_slow([0.0, 0.08], 0.08))
@pytest.mark.parametrize(
    ("seed", "roll_deg", "pitch_deg", "curvature"),
    [(BENT, 0.0, 2.0, 0.0), (BENT, 7.0, 4.0, 0.001), (STRAIGHT, -25.0, 1.0, -0.001)],
)
def test_every_road_pixel_shows_the_first_point_that_a_march_along_its_ray_finds(
    shape, gutter, seed, roll_deg, pitch_deg, curvature
):
    roll, pitch = map(math.radians, (roll_deg, pitch_deg))
    spec = FrameSpec("open", roll, pitch, curvature, shape, gutter=gutter, seed=seed, **SMALL)
    road = carriageway_of(spec)
    assert (road.course.bend != 0) == (seed == BENT)
    disparity, is_road = true_disparity(spec)
    near = is_road & (disparity > spec.focal * spec.baseline / 40)
    v, u = (at[::53] for at in np.nonzero(near))
    assert len(u) > 150
    marched = marched_disparity(spec, road, u, v)
    # a march can step over the outermost centimetres of the road beside a kerb
    assert np.mean(np.isnan(marched)) < 0.01
    assert np.nanmax(np.abs(marched - disparity[v, u])) < 1e-6


@pytest.mark.parametrize("shape", ["flat", *SHAPES])
def test_truth_says_how_the_road_bends_upward_ahead_of_the_rig(shape):
    crossfall = 0.0 if shape == "flat" else 0.04
    spec = FrameSpec("bare", curvature=0.001, bend=0.006, cross_section=shape, crossfall=crossfall)
    road = carriageway_of(spec)
    x, y, z = road.course.heading, 0.0, 1.0  # straight ahead
    below, _ = height_over_road(spec, road, np.array([x, y, z]))
    (truth,) = csv.DictReader(truth_csv([("frame", spec)]).decode().splitlines())
    assert float(truth["curvature_per_m"]) == pytest.approx(-2 * below / z**2, abs=1e-6)


@pytest.mark.parametrize("shape", ["flat", *SHAPES])
@pytest.mark.parametrize("scene", ["bare", "verge"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_ground_of_a_country_road_has_no_steps(shape, scene, seed):
    crossfall = 0.0 if shape == "flat" else 0.04
    spec = FrameSpec(scene, cross_section=shape, crossfall=crossfall, gutter=0.1, seed=seed)
    road, grounds = carriageway_of(spec), [s for s in build_scene(spec).surfaces if isinstance(s, Ground)]
    edges = {edge for ground in grounds for edge in ground.edges if math.isfinite(edge)}
    assert len(edges) >= 2
    down = np.array([[0.0], [-1.0], [0.0]])
    for edge in edges:
        heights = []
        for lateral in (edge - 1e-7, edge + 1e-7):
            above = road.course.point(lateral, 6.0, 50.0)[:, None]
            heights.append(50.0 - min(float(ground.intersect(above, down)[0]) for ground in grounds))
        assert abs(heights[0] - heights[1]) < 1e-6
