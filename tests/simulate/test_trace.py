"""Which surface a ray hits: the shortcuts of tracing change nothing."""

import math

import numpy as np
import pytest

from rollcli.simulate.build import build_scene
from rollcli.simulate.camera import PixelRays
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.surfaces import NEAR
from rollcli.simulate.views import NONE, first_hits, trace

SPEC = FrameSpec("street", math.radians(8), math.radians(3), seed=11, size=(160, 120), focal=93.0)


def every_pixel(spec):
    scene = build_scene(spec)
    camera = spec.cameras(scene.normal)[0]
    return scene, PixelRays.of_rows(camera, range(spec.size[1]))


@pytest.mark.parametrize("seed", [3, 11, 19])
@pytest.mark.parametrize("scene", ["open", "street", "verge"])
def test_each_ray_meets_the_nearest_of_all_surfaces(scene, seed):
    scene, pixels = every_pixel(FrameSpec(scene, 0.14, 0.05, seed=seed, size=(160, 120), focal=93.0))
    depth, surface = first_hits(scene, pixels)
    # without the boxes around objects, which spare rays that pass by
    every = np.array([s.intersect(pixels.rays.origin, pixels.rays.direction) for s in scene.surfaces])
    nearest = every.min(axis=0)
    assert np.array_equal(depth, nearest)
    assert np.array_equal(surface, np.where(np.isfinite(nearest), every.argmin(axis=0), -1))


def test_positions_between_pixels_are_traced_as_whole_rows_are():
    scene, rows = every_pixel(SPEC)
    depth, surface = first_hits(scene, rows)
    anywhere = PixelRays.at(rows.camera, rows.u, rows.v)
    assert np.array_equal(first_hits(scene, anywhere)[0], depth)
    part = PixelRays.of_rows(rows.camera, range(37, 90))
    assert np.array_equal(first_hits(scene, part)[1], surface.reshape(120, 160)[37:90].ravel())


def test_a_ray_that_meets_nothing_sees_the_sky():
    scene, pixels = every_pixel(SPEC)
    hits = trace(scene, pixels)
    sky = np.isinf(hits.depth)
    assert 0.05 < sky.mean() < 0.6
    assert np.array_equal(sky, hits.surface == -1)
    assert np.array_equal(sky, hits.material == NONE)
    assert hits.depth.min() > NEAR


def test_a_footprint_is_the_area_that_neighbouring_rays_enclose_on_the_road():
    spec = FrameSpec("bare", math.radians(20), math.radians(5), seed=4, size=(160, 120), focal=93.0)
    scene, pixels = every_pixel(spec)
    hits = trace(scene, pixels)
    depth = np.minimum(hits.depth, 1000.0)
    points = (pixels.rays.origin + depth * pixels.rays.direction).reshape(3, 120, 160)
    near = (hits.depth < 12).reshape(120, 160)[1:-1, 1:-1]
    # central differences on the ground, which is level: x and z span it
    across = (points[:, 1:-1, 2:] - points[:, 1:-1, :-2])[[0, 2]] / 2
    down = (points[:, 2:, 1:-1] - points[:, :-2, 1:-1])[[0, 2]] / 2
    area = np.abs(across[0] * down[1] - across[1] * down[0])[near]
    longest = np.linalg.svd(np.stack([across, down], axis=-1)[:, near].transpose(1, 0, 2), compute_uv=False)
    long, short = hits.reads[4:6].reshape(2, 120, 160)[:, 1:-1, 1:-1][:, near]
    assert near.sum() > 2000
    assert np.allclose(long, longest[:, 0], rtol=0.01)
    assert np.allclose(long * short, area, rtol=0.01)


def box(low, high):
    """The corners of a box in the world, (3, 8)."""
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij")).reshape(3, -1)


def test_a_box_around_the_camera_may_be_met_by_any_ray_and_one_behind_it_by_none():
    _, pixels = every_pixel(SPEC)
    assert pixels.window(None) is None
    assert pixels.window(box((-1, 0, -2), (1, 3, 2))) is None
    assert pixels.window(box((-1, 0, 0.05), (1, 3, 9))) is None
    assert len(pixels.window(box((-1, 0, -9), (1, 3, -4)))) == 0
    ahead = pixels.window(box((-1, 0, 4), (1, 2, 9)))
    assert 0 < len(ahead) < len(pixels.u)
