"""Pairs are matched over a range that they show themselves."""

import math

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.estimator.road.find import road_plane
from rollcli.files.formats import read_image
from rollcli.files.inputs import pair_inputs, stem_of
from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from rollcli.stereo import sgbm
from rollcli.stereo.match import StereoOptions, compute_disparity, match_pair
from tests.odd_views import pair_at, seen_by
from tests.real_pairs import ROADS, ROLL_DEG, STREETS, needs_roads, needs_streets, real_pairs


@pytest.fixture(scope="module")
def street():
    return render_frame(FrameSpec(scene="street", roll=math.radians(4), size=(320, 240), seed=3))


@pytest.fixture(scope="module")
def large_street():
    return render_frame(FrameSpec(scene="street", roll=math.radians(2), seed=5, colour=False))


@pytest.mark.parametrize("mode", ["3way", "sgbm", "hh"])
def test_a_shifted_image_gives_its_shift(mode):
    left, right = pair_at(23)

    match = match_pair(left, right, StereoOptions(mode=mode))

    inside = match.disparity[:, match.num_disparities + 5 : -5]
    assert match.disparity.dtype == np.float32
    assert match.disparity.shape == left.shape
    assert (np.abs(inside - 23) < 0.5).mean() > 0.95


@pytest.mark.parametrize("largest", [5, 40, 110, 170])
def test_the_range_found_holds_the_disparities_and_not_much_more(largest):
    left, right = pair_at(np.linspace(largest / 4, largest, 120))

    match = match_pair(left, right, StereoOptions(align="off"))

    assert largest + 2 <= match.num_disparities <= 1.3 * largest + 48
    assert match.end_fraction < 0.01


@pytest.mark.parametrize("first", [-16, 0, 24])
def test_the_range_found_ends_where_it_does_whatever_it_begins_with(first):
    left, right = pair_at(np.linspace(30, 60, 120))

    match = match_pair(left, right, StereoOptions(align="off", min_disparity=first))

    assert match.min_disparity == first
    assert 62 <= first + match.num_disparities <= 1.3 * 60 + 48


def test_the_range_does_not_follow_what_cannot_be_matched():
    left, right = pair_at(20)
    left[:, :250] = right[:, :200] = 255  # a low sun

    assert match_pair(left, right, StereoOptions()).num_disparities <= 80


def test_a_range_that_is_too_short_is_seen_at_its_end():
    left, right = pair_at(np.linspace(10, 40, 120))

    assert match_pair(left, right, StereoOptions(num_disparities=32)).end_fraction > 0.04
    assert match_pair(left, right, StereoOptions(num_disparities=64)).end_fraction < 0.001


def test_a_given_range_is_rounded_up_and_kept_within_the_image():
    left, right = pair_at(20)

    assert match_pair(left, right, StereoOptions(num_disparities=50)).num_disparities == 64
    assert match_pair(left, right, StereoOptions(num_disparities=2000)).num_disparities == 384


def test_a_range_may_start_anywhere():
    left, right = pair_at(150)

    match = match_pair(left, right, StereoOptions(min_disparity=128, num_disparities=32))

    assert (match.min_disparity, match.num_disparities) == (128, 32)
    assert np.median(match.disparity[match.disparity > 0]) == pytest.approx(150, abs=0.1)


def test_disparities_below_zero_are_no_data():
    left, right = pair_at(-10)

    disparity = compute_disparity(left, right, min_disparity=-32, num_disparities=64)

    assert (disparity >= 0).all()
    assert (disparity > 0).mean() < 0.05


def test_matching_small_gives_a_small_map_in_its_own_pixels():
    left, right = pair_at(40)

    disparity = compute_disparity(left, right, downscale=2)

    assert disparity.shape == (60, 200)
    assert np.median(disparity[disparity > 0]) == pytest.approx(20, abs=0.1)


def test_colour_grey_and_16_bits_give_much_the_same(street):
    grey = [cv2.cvtColor(view, cv2.COLOR_BGR2GRAY) for view in (street.left, street.right)]
    twelve_bits = [view.astype(np.uint16) * 16 for view in grey]

    from_colour = compute_disparity(street.left, street.right)

    np.testing.assert_array_equal(compute_disparity(*grey), from_colour)
    both = (compute_disparity(*twelve_bits) > 0) & (from_colour > 0)
    assert both.sum() > 0.9 * (from_colour > 0).sum()
    assert np.median(np.abs(compute_disparity(*twelve_bits) - from_colour)[both]) < 0.1


def test_the_whole_map_beside_it_has_every_row_at_full_size(street):
    at_once = match_pair(street.left, street.right, StereoOptions()).disparity
    shown = match_pair(street.left, street.right, StereoOptions(), road_plane)
    alone = shown.disparity.copy()

    assert shown.whole is shown.whole  # matched once
    np.testing.assert_array_equal(shown.disparity, alone)
    both = (at_once > 0) & (shown.whole > 0)
    assert both.sum() > 0.97 * (at_once > 0).sum()
    assert (np.abs(at_once - shown.whole)[both] < 0.1).mean() > 0.97


def test_a_rendered_street_is_matched_as_it_is(street):
    disparity = compute_disparity(street.left, street.right)

    both = (disparity > 0) & (street.disparity > 0)
    errors = np.abs(disparity - street.disparity)[both]
    assert both.mean() > 0.4
    assert np.median(errors) < 0.3
    assert (errors > 3).mean() < 0.05


@pytest.mark.parametrize(
    ("lies", "noise", "doubted"),
    [
        ({"clockwise_deg": 2.2}, 0, True),
        ({"larger_percent": 2.5}, 0, True),
        ({"lower": 14}, 0, True),
        ({"larger_percent": 0.5}, 0, False),
        ({"larger_percent": 0.5}, 25, True),  # no rig is so, and the blocks do not agree
        ({}, 25, False),
    ],
)
def test_a_correction_that_no_rig_in_use_needs_is_doubted(large_street, lies, noise, doubted):
    rng = np.random.default_rng(0)
    left, right = (
        np.clip(view + rng.normal(0, noise, view.shape), 0, 255).astype(np.uint8)
        for view in (large_street.left, seen_by(large_street.right, **lies))
    )
    assert ("too far from level" in match_pair(left, right, StereoOptions()).doubt) == doubted


def test_the_same_pair_gives_the_same_map_whatever_the_threads(street):
    threads = cv2.getNumThreads()
    maps = []
    try:
        for count in (1, 2, 5):
            cv2.setNumThreads(count)
            maps.append(compute_disparity(street.left, street.right))
    finally:
        cv2.setNumThreads(threads)

    np.testing.assert_array_equal(maps[0], maps[1])
    np.testing.assert_array_equal(maps[0], maps[2])


def test_a_pair_without_texture_has_no_disparities():
    flat = np.full((120, 400), 90, np.uint8)

    match = match_pair(flat, flat, StereoOptions())

    assert not match.disparity.any()
    assert match.end_fraction == 0
    assert "to tell whether the views are level" in match.doubt


@needs_roads
def test_real_road_pairs_need_and_get_a_wide_range():
    for left, right in pair_inputs(str(ROADS / "left"), str(ROADS / "right")):
        match = match_pair(read_image(left.location), read_image(right.location), StereoOptions(downscale=4))
        inside = match.disparity[:, match.num_disparities :]

        assert 4 * match.num_disparities > 331
        assert match.end_fraction < 0.001
        assert (inside > 0).mean() > 0.9
        roll_deg = math.degrees(estimate_roll(match.disparity, Request(road="all")).theta)
        assert roll_deg == pytest.approx(ROLL_DEG[stem_of(left.location)], abs=0.15)


@pytest.mark.slow
@needs_streets
def test_real_street_pairs_get_a_range_that_fits():
    for left, right in real_pairs(slice(None), STREETS):
        match = match_pair(left, right, StereoOptions(downscale=2))

        assert 32 <= match.num_disparities <= 112
        assert match.end_fraction < 0.03
        assert (match.disparity[:, match.num_disparities :] > 0).mean() > 0.6


def test_what_the_mode_hh_would_take_is_counted_before_it_is_taken(monkeypatch):
    blank = np.zeros((2160, 4096), np.uint8)
    options = StereoOptions(mode="hh", num_disparities=512, vertical_offset=0)
    with pytest.raises(InputError, match=r"would take 14\.8 GiB, and 4 are allowed; give --downscale 2"):
        match_pair(blank, blank, options)
    pair = pair_at(20)
    options = StereoOptions(mode="hh", num_disparities=64, vertical_offset=0)
    monkeypatch.setattr(sgbm, "_MOST_HH_BYTES", 4 * 120 * (400 - 64) * 64)
    assert match_pair(*pair, options).disparity.any()
    monkeypatch.setattr(sgbm, "_MOST_HH_BYTES", 4 * 120 * (400 - 64) * 64 - 1)
    with pytest.raises(InputError, match="in the mode hh"):
        match_pair(*pair, options)


@pytest.mark.parametrize("first", [10, 20])
@pytest.mark.parametrize(
    ("name", "truth"), [("frame_0001", -8.0), ("frame_0003", 12.0), ("frame_0004", -4.0)]
)
def test_a_range_that_begins_nearer_leaves_the_roll_as_it_is(name, truth, first):
    left, right = (read_image(f"sample_data/{side}/{name}.png") for side in ("left", "right"))

    disparity = compute_disparity(left, right, min_disparity=first, align="off")

    assert disparity[disparity > 0].min() > first
    assert np.degrees(estimate_roll(disparity).theta) == pytest.approx(truth, abs=0.03)
