"""Maps shifted to where the grey levels agree: against true disparities, of synthetic and rendered pairs."""

import math

import cv2
import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import draw_specs
from rollcli.stereo import match as stereo
from rollcli.stereo import refinement
from rollcli.stereo.alignment import level
from rollcli.stereo.match import StereoOptions, match_pair
from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.refinement import refined

SHAPE = (96, 160)
V, U = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)


def seen(disparity, noise=0.0, gain=1.0, offset=0.0, contrast=1.0):
    """Views of a surface: the left one shows at u what the right one shows at u - disparity."""
    rng = np.random.default_rng(5)
    right = cv2.GaussianBlur(rng.normal(0, 150, SHAPE).astype(np.float32), (0, 0), 1.3)
    right = 110 + contrast * right
    left = cv2.remap(right, U - disparity, V, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    views = (left, gain * right + offset)
    return tuple(
        np.clip(np.rint(view + noise * rng.standard_normal(SHAPE)), 0, 255).astype(np.uint8) for view in views
    )


def plane(across=0.02, down=0.3):
    return (5 + across * U + down * V - min(0, across) * SHAPE[1]).astype(np.float32)


def error(found, true):
    """Of what both views show."""
    return (found - true)[:, -SHAPE[1] // 2 :]


@pytest.mark.parametrize("off", [-0.4, -0.1, 0.15, 0.4])
@pytest.mark.parametrize("slopes", [(0.0, 0.05), (0.02, 0.3), (-0.2, 0.25), (0.3, 0.05)])
def test_a_plane_is_shifted_to_where_it_is(off, slopes):
    true = plane(*slopes)
    left = error(refined(true + np.float32(off), seen(true)), true)
    assert np.abs(left[8:-8, :-8]).max() < 0.1 + 0.2 * abs(off)
    assert abs(left.mean()) < 0.1 * abs(off)


def test_an_error_that_changes_slowly_is_taken_away_and_the_plane_is_no_longer_tilted():
    true = plane()
    tilted = true + (0.002 * (U - SHAPE[1] / 2)).astype(np.float32)
    left = error(refined(tilted, seen(true, noise=1.5)), true)
    slope = np.polyfit(np.arange(left.shape[1]), left.mean(axis=0), 1)[0]
    assert abs(slope) < 0.0002


@pytest.mark.parametrize(
    "lies",
    [Misalignment(0.4), Misalignment(rotation=-0.004), Misalignment(scale=0.004), Misalignment(0.2, 0.003)],
)
def test_a_right_view_that_lies_off_is_read_where_it_shows_the_points(lies):
    true = plane()
    left, right = seen(true)
    off = level(right, lies.times(-1))
    shifted = true - np.float32(0.3)

    error_then = error(refined(shifted, (left, off), lies), true)[8:-8]
    assert abs(error_then.mean()) < 0.03
    assert np.abs(error_then).mean() < 0.7 * np.abs(error(refined(shifted, (left, off)), true)[8:-8]).mean()


@pytest.mark.parametrize(("gain", "offset"), [(1.1, 0.0), (0.9, 5.0), (1.0, -12.0)])
def test_views_may_differ_in_brightness(gain, offset):
    true = plane()
    left = error(refined(true - np.float32(0.2), seen(true, gain=gain, offset=offset)), true)
    assert abs(left.mean()) < 0.02


def test_without_texture_a_map_stays_as_it_is():
    true = plane()
    flat = np.full(SHAPE, 90, np.uint8)
    assert np.array_equal(refined(true, (flat, flat)), true)
    faint = error(refined(true - np.float32(0.2), seen(true, contrast=0.01, noise=0.3)), true)
    assert abs(faint.mean() + 0.2) < 0.05  # there is hardly anything to go by


def test_no_data_stays_and_what_lies_beside_it_is_shifted_as_the_rest():
    true = plane()
    views = seen(true)
    holes = true - np.float32(0.2)
    holes[20:44, 100:132] = 0
    holes[::7, 120:] = 0
    found = refined(holes, views)
    assert np.array_equal(found > 0, holes > 0)
    assert not found[holes <= 0].any()
    beside = error(np.where(holes > 0, found, true), true)
    assert abs(beside[holes[:, -SHAPE[1] // 2 :] > 0].mean()) < 0.04


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.3, 0.0), (0.02, -0.1)], ids=["wall", "slanted", "ceiling"])
def test_what_does_not_rise_down_the_image_stays_where_it_is(slopes):
    true = plane(*slopes)
    true -= min(0, true.min() - 5)
    given = true + np.float32(0.3)
    assert np.array_equal(refined(given, seen(true)), given)


def test_an_edge_stays_where_it_is():
    step = np.where(U < 100, np.float32(12), np.float32(30)).astype(np.float32)
    assert np.array_equal(refined(step, seen(step + 1))[:, 96:104], step[:, 96:104])


@pytest.mark.parametrize("shape", [(8, 160), (15, 15), (96, 9), (5, 5)])
def test_a_map_of_one_block_or_none_stays_as_it_is(shape):
    small = plane()[: shape[0], : shape[1]].copy()
    view = np.zeros(shape, np.uint8)
    assert refined(small, (view, view)) is small


def test_the_map_given_is_not_changed_and_parts_give_the_same(monkeypatch):
    true = plane()
    views, given = seen(true), true - np.float32(0.3)
    before = given.copy()
    whole = refined(given, views)
    assert np.array_equal(given, before)
    monkeypatch.setattr(refinement, "_TOGETHER", 1)
    np.testing.assert_allclose(refined(given, views), whole, atol=1e-5)


@pytest.mark.slow
def test_matched_roads_lie_nearer_to_where_they_are_and_so_do_their_angles(monkeypatch):
    """Rendered truth: the mean error of each road, whose part that changes across it tilts the plane."""
    errors = {"smoothed": [], "refined": []}
    offsets = {"smoothed": [], "refined": []}
    specs = draw_specs(SimulateOptions(frames=8, scene="bare", roll_deg=(-28.6, 28.6), seed=71, grey=True))
    for spec in specs:
        frame = render_frame(spec)
        for name, step in (("smoothed", lambda disparity, *_: disparity), ("refined", refined)):
            monkeypatch.setattr(stereo, "refined", step)
            found = match_pair(frame.left, frame.right, StereoOptions()).disparity
            road = frame.road & (abs(found - frame.disparity) < 1)
            offsets[name].append(float((found - frame.disparity)[road].mean()))
            errors[name].append(math.degrees(estimate_roll(found).theta - spec.roll))

    def typical(values):
        return float(np.sqrt(np.mean(np.square(values))))

    assert typical(offsets["refined"]) < 0.6 * typical(offsets["smoothed"])
    assert typical(errors["refined"]) < 0.8 * typical(errors["smoothed"])


def test_no_disparity_is_shifted_below_zero():
    v = np.arange(64, dtype=np.float32)[:, None]
    disparity = np.broadcast_to(0.02 * v + np.float32(0.05), (64, 128)).astype(np.float32)
    noise = np.random.default_rng(0).integers(0, 256, (64, 128), dtype=np.uint8)
    right = cv2.GaussianBlur(noise, (0, 0), 1.2)
    left = np.roll(right, -1, axis=1)  # a pixel farther than infinity

    assert refined(disparity, (left, right)).min() >= 0
