"""Rough roads against ISO 8608 and isotropy, on what is drawn; their truth on what is rendered."""

import csv
import functools
import math
from itertools import product

import numpy as np
import pytest

from rollcli.simulate.build import build_scene, carriageway_of, render_frame
from rollcli.simulate.dataset import lane_rolls_of, truth_csv
from rollcli.simulate.relief import LEFT, STEP, draw_relief
from rollcli.simulate.spec import FrameSpec
from tests.slow import mostly_slow
from tests.true_disparity import true_disparity

FLAT, CROWNED, LOW = {}, {"cross_section": "crown", "crossfall": 0.03, "bend": 0.003}, {"height": 0.3}
NOWHERE = (-100.0, -100.0)  # tracks and patches: none on the grid


@functools.cache
def fields(roughness, count):
    """Random fields (count, along, across) without patches and tracks."""
    reliefs = [draw_relief(np.random.default_rng(seed), roughness, NOWHERE, NOWHERE) for seed in range(count)]
    return np.array([relief.heights for relief in reliefs])


def density(first, second, step, axis):
    """One-sided cross density of profiles along an axis, m^3, and the waves per metre."""
    n = first.shape[axis]
    products = np.fft.rfft(first, axis=axis) * np.fft.rfft(second, axis=axis).conj()
    others = tuple(k for k in range(first.ndim) if k != axis)
    return 2 * step / n * products.real.mean(others), np.fft.rfftfreq(n, step)


@pytest.mark.parametrize(("roughness", "middle"), [("A", 16e-6), ("D", 1024e-6)])
@pytest.mark.parametrize("axis", [1, 2], ids=["along", "across"])
def test_profiles_have_the_density_of_their_class_in_both_directions(roughness, middle, axis):
    heights = fields(roughness, 3)
    found, waves = density(heights, heights, STEP, axis)
    for low, high in ((0.1, 0.2), (0.2, 0.5), (0.5, 1.5)):
        within = (waves >= low) & (waves < high)
        asked = middle * (waves[within] / 0.1) ** -2
        assert found[within].sum() == pytest.approx(asked.sum(), rel=0.15)


def test_tracks_and_patches_are_where_the_lane_is():
    for seed in range(3):
        plain = draw_relief(np.random.default_rng(seed), "C", NOWHERE, NOWHERE)
        sunken = draw_relief(np.random.default_rng(seed), "C", NOWHERE, (-0.8, 0.9))
        change = sunken.heights - plain.heights
        across = LEFT + STEP * np.arange(change.shape[1])
        assert np.ptp(change[:, np.abs(across) > 2.5]) < 1e-9
        depths = [np.median(change[:, -1]) - change[:, np.abs(across - x).argmin()] for x in (-0.8, 0.9)]
        assert all(depth.min() >= 0 and depth.max() < 4 * 0.003 for depth in depths)


def scanned_depth(spec, u, v):
    """Depth of the first ground along the ray of a pixel, metres, by a scan in steps of 2 mm."""
    carriageway = carriageway_of(spec)
    camera = spec.cameras(build_scene(spec).normal)[0]
    rays = camera.rays(np.array([float(u)]), np.array([float(v)]))
    t = np.arange(0.1, 40.0, 0.002)
    points = rays.origin + rays.direction * t
    lateral = carriageway.course.lateral(points)
    places = np.linspace(lateral.min(), lateral.max(), 2000)
    smooth = np.interp(lateral, places, [carriageway.section.elevation(x) for x in places.tolist()])
    ground = smooth + carriageway.relief.height(lateral, points[2])
    return t[np.argmax(carriageway.course.elevation(points) < ground)]


@pytest.mark.parametrize(
    ("roughness", "section"), mostly_slow(product("AE", (FLAT, CROWNED, LOW)), ("E", CROWNED))
)
def test_rays_end_where_a_fine_scan_meets_the_uneven_road(roughness, section):
    spec = FrameSpec(
        "bare", 0.05, 0.03, 0.0005, size=(160, 120), focal=93, roughness=roughness, seed=3, **section
    )
    disparity, road = true_disparity(spec)
    depth = spec.focal * spec.baseline / np.where(disparity > 0, disparity, np.nan)
    rows, columns = np.nonzero(road & (depth < 30))
    for k in range(0, len(rows), len(rows) // 12):
        found = scanned_depth(spec, columns[k], rows[k])
        assert depth[rows[k], columns[k]] == pytest.approx(found, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_lane_of_a_rough_road_has_the_rolls_of_its_pixels_and_no_height(seed):
    spec = FrameSpec("bare", 0.05, 0.04, size=(800, 600), focal=464, roughness="C", seed=seed, dips=0)
    low, high = lane_rolls_of(spec)
    assert low < high < low + math.radians(1)
    assert low - 0.001 < spec.roll < high + 0.001
    disparity, road = true_disparity(spec)
    v, u = np.nonzero(road)
    z = spec.focal * spec.baseline / disparity[road]
    x, y = (u - spec.centre[0]) * z / spec.focal, (v - spec.centre[1]) * z / spec.focal
    course = carriageway_of(spec).course
    used = (np.abs(x - z * course.heading) < 1.2) & (z > 4) & (z < 20)
    design = np.array([np.ones_like(x), x, z, z * z])[:, used]
    fitted = np.linalg.lstsq(design.T, y[used], rcond=None)[0]
    assert low - 0.0007 < math.atan(fitted[1]) < high + 0.0007
    (truth,) = csv.DictReader(truth_csv([("frame", spec)]).decode().splitlines())
    assert float(truth["curvature_per_m"]) == pytest.approx(-2 * fitted[3], abs=1e-4)  # y points down
    assert abs(render_frame(spec).heights[road][used].mean()) < 0.001
