"""Where only the angle is wanted, a pair's road is matched along its plane: as right as the whole match."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.estimator.road.find import road_plane
from rollcli.run.library import estimate_pair
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from rollcli.stereo import match as matching
from rollcli.stereo.along_road import Levelled
from rollcli.stereo.match import StereoOptions, compute_disparity, match_pair
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.views import prepare_views
from tests.odd_views import seen_by
from tests.real_pairs import LIDAR, needs_lidar, real_pairs
from tests.true_disparity import true_disparity

SPEC = FrameSpec(scene="street", roll=math.radians(4), size=(640, 480), seed=3)


@pytest.fixture(scope="module")
def street():
    return render_frame(SPEC)


@pytest.fixture(scope="module")
def whole(street):
    return match_pair(street.left, street.right, StereoOptions())


@pytest.fixture(scope="module")
def road(street):
    return match_pair(street.left, street.right, StereoOptions(), road_plane)


def test_the_road_is_as_near_to_the_truth_as_in_the_whole_map(whole, road):
    truth, _ = true_disparity(SPEC)
    below = np.s_[280:]
    both = (whole.disparity[below] > 0) & (road.disparity[below] > 0) & (truth[below] > 0)
    assert both.mean() > 0.6
    off, off_whole = (np.abs(each.disparity - truth)[below][both] for each in (road, whole))
    assert np.median(off) < 0.1
    assert np.median(off) <= np.median(off_whole)
    assert (off < 1).mean() >= (off_whole < 1).mean() - 0.01


def test_what_lies_above_and_beside_the_road_is_known_of_smaller_views(whole, road):
    above = np.s_[20:140]
    both = (whole.disparity[above] > 0) & (road.disparity[above] > 0)
    assert both.mean() > 0.5 * (whole.disparity[above] > 0).mean()
    assert np.median(np.abs(whole.disparity - road.disparity)[above][both]) < 0.5


def angles(left, right):
    """Both estimates: along the road, and from the whole match."""
    for finder in (road_plane, None):
        match = match_pair(left, right, StereoOptions(), finder)
        yield estimate_roll(match.disparity, Request(slope_error=match.slope_error))


def assert_agree(pairs):
    both = [tuple(angles(left, right)) for left, right in pairs]
    apart = np.array([abs(along.theta - whole.theta) for along, whole in both])
    reach = np.array([math.hypot(along.ci95, whole.ci95) for along, whole in both])
    assert np.median(apart) <= np.median(reach) / 2
    assert (apart <= reach).all()


@pytest.mark.slow
def test_rendered_roads_get_the_angle_of_the_whole_match():
    asked = SimulateOptions(frames=6, size=(640, 480), seed=17, grey=True)
    frames = [render_frame(spec) for spec in draw_specs(asked)]
    assert_agree([(frame.left, frame.right) for frame in frames])


@pytest.mark.slow
@needs_lidar
def test_real_roads_get_the_angle_of_the_whole_match():
    assert_agree(real_pairs(slice(None, None, 6)))


def assert_map_agrees(left, right):
    match = match_pair(left, right, StereoOptions(), road_plane)
    request = Request(slope_error=match.slope_error)
    along = estimate_roll(match.disparity, request)
    whole = estimate_roll(compute_disparity(left, right), request)
    assert abs(along.theta - whole.theta) <= along.ci95 / 2


@pytest.mark.slow
@pytest.mark.parametrize("spec", draw_specs(SimulateOptions(frames=8, size=(640, 480), seed=18, grey=True)))
def test_a_map_of_everything_gives_the_angle_of_the_pair(spec):
    """Its road is matched along the plane, too; what is beside it differs, and where nothing was found."""
    frame = render_frame(spec)
    assert_map_agrees(frame.left, frame.right)


@pytest.mark.slow
@needs_lidar
def test_a_map_of_a_real_pair_gives_its_angle():
    for pair in real_pairs(slice(1, None, 4)):
        assert_map_agrees(*pair)


@pytest.mark.parametrize(("lower", "clockwise_deg"), [(3.0, 0.0), (0.0, 0.4), (-1.5, -0.3), (-0.05, 0.0)])
def test_a_right_view_that_is_out_of_place_is_levelled_on_the_way(street, road, lower, clockwise_deg):
    moved = seen_by(street.right, clockwise_deg=clockwise_deg, lower=lower)

    found = match_pair(street.left, moved, StereoOptions(), road_plane)

    assert found.corrected.offset == pytest.approx(lower, abs=0.15)
    assert math.degrees(found.corrected.rotation) == pytest.approx(clockwise_deg, abs=0.03)
    both = (found.disparity > 0) & (road.disparity > 0)
    assert both.sum() > 0.9 * (road.disparity > 0).sum()
    assert np.median(np.abs(found.disparity - road.disparity)[both]) < 0.1
    assert abs(np.diff([estimate_roll(each.disparity).roll_deg for each in (found, road)])) < 0.01


@pytest.mark.parametrize(
    "wrong",
    [
        (180.0, 0.0, 0.01),  # nearer than anything
        (-60.0, 0.2, 0.02),  # a wall that cuts through the scene
        (0.0, 0.0, 0.3),  # too steep
    ],
)
def test_along_a_plane_that_is_no_road_nothing_is_matched(street, whole, wrong):
    at_origin, *slopes = wrong
    found = match_pair(
        street.left, street.right, StereoOptions(), lambda _, smaller: (at_origin / smaller, *slopes)
    )
    below = np.s_[300:]
    both = (found.disparity[below] > 0) & (whole.disparity[below] > 0)
    assert both.sum() > 0.98 * (whole.disparity[below] > 0).sum()
    assert (np.abs(found.disparity - whole.disparity)[below][both] < 0.1).mean() > 0.98
    assert found.lacks_road


def test_without_a_road_all_is_matched_as_a_whole(street, whole):
    found = match_pair(street.left, street.right, StereoOptions(), lambda *_: None)
    np.testing.assert_array_equal(found.disparity, whole.disparity)
    assert found.lacks_road


@pytest.mark.parametrize(
    "given",
    [{"mode": "sgbm"}, {"num_disparities": 96}, {"block_size": 7}, {"uniqueness": 5}, {"speckle_size": 50}],
)
def test_who_sets_how_to_match_gets_that_match_of_the_road(street, given):
    options = StereoOptions(**given)
    found, whole = (match_pair(street.left, street.right, options, finder) for finder in (road_plane, None))
    below = np.s_[300:]
    assert (np.abs(found.disparity - whole.disparity)[below] < 0.1).mean() > 0.98
    assert not found.lacks_road  # none was asked for


@pytest.mark.parametrize("given", [{"align": "off"}, {"vertical_offset": 0.0}])
def test_a_given_alignment_changes_no_road_of_level_views(street, road, given):
    found = match_pair(street.left, street.right, StereoOptions(**given), road_plane)
    np.testing.assert_array_equal(found.disparity, road.disparity)
    assert not found.lacks_road


def test_behind_the_horizon_all_is_matched_as_a_whole(street):
    options = StereoOptions(min_disparity=-16)
    found, whole = (match_pair(street.left, street.right, options, finder) for finder in (road_plane, None))
    np.testing.assert_array_equal(found.disparity, whole.disparity)


def test_a_wide_view_is_matched_over_a_wider_range():
    """Its road bends by more pixels: 9 px at its middle are found at 1,920 px, and not at a third of that."""
    height, width = 400, 1920
    rng = np.random.default_rng(2)
    texture = rng.integers(0, 256, (height, width + 400), dtype=np.uint8)
    texture = cv2.GaussianBlur(texture, (0, 0), 1.2)
    v = np.arange(height, dtype=np.float32)
    truth = 20 + 0.3 * v + 9 * np.sin(np.pi * v / height)
    u = np.arange(width, dtype=np.float32)
    rows = np.broadcast_to(v[:, None], (height, width))
    right = cv2.remap(texture, u + truth[:, None], rows, cv2.INTER_LANCZOS4)
    plane = (20 / 3, 0.0, 0.3)
    options = StereoOptions(align="off")

    found = match_pair(texture[:, :width], right, options, lambda *_: plane).disparity

    bent = truth - 20 - 0.3 * v > 7
    off = np.abs(found - truth[:, None])[bent]
    assert (off < 0.1).mean() > 0.7


def test_a_road_found_along_its_plane_beyond_the_range_is_not_at_its_end(street, monkeypatch):
    looked = matching.first_look
    monkeypatch.setattr(matching, "first_look", lambda small: replace(looked(small), range=56))
    found = match_pair(street.left, street.right, StereoOptions(), road_plane)

    assert found.disparity.max() > found.num_disparities + 10
    assert found.end_fraction < 0.05


@pytest.mark.parametrize(("border", "level"), [((0, 60), 0), ((60, 60), 0), ((60, 60), 16)])
def test_black_borders_of_views_are_no_data_and_the_road_is_found(street, border, level):
    left, right = (
        cv2.copyMakeBorder(each, *border, 40, 40, cv2.BORDER_CONSTANT, value=level)
        for each in (street.left, street.right)
    )
    found = match_pair(left, right, StereoOptions(), road_plane)
    estimate = estimate_roll(found.disparity)

    assert not found.disparity[-60:].any()
    assert estimate.status == "ok"
    assert math.degrees(estimate.theta) == pytest.approx(4, abs=0.1)


@needs_lidar
@pytest.mark.parametrize(("darker", "larger"), [(2, 1), (1, 2)])
def test_a_street_that_is_dark_in_one_view_or_seen_twice_as_large_has_much_the_same_roll(darker, larger):
    views = [cv2.imread(str(LIDAR / side / "000002.png"), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")]
    left, right = (cv2.resize(each, None, None, larger, larger, cv2.INTER_CUBIC) for each in views)

    same, other = estimate_pair(*views), estimate_pair(left // darker, right)

    assert other.status == same.status
    assert other.roll_deg == pytest.approx(same.roll_deg, abs=0.1)


@pytest.mark.parametrize(("lower", "searches"), [(1.5, 1), (2.5, 2)])
def test_a_pair_that_hardly_moves_is_matched_again_along_the_same_plane(street, lower, searches):
    asked = []

    def find(small, smaller):
        asked.append(smaller)
        return road_plane(small, smaller)

    views = prepare_views(street.left, street.right)
    first = Levelled(views, LEVEL, None, 0, 64, StereoOptions(), find)
    again = replace(first, lies=Misalignment(lower), before=first)
    assert None not in (first.plane, again.plane)
    assert asked == [4] * searches


@needs_lidar
@pytest.mark.parametrize("place", [17, 22])  # a road in the shade of trees, and one that glares
def test_no_seed_finds_another_plane(place):
    (pair,) = real_pairs(slice(place, place + 1))
    rolls = [estimate_pair(*pair, seed=seed).roll_deg for seed in range(4)]
    assert np.ptp(rolls) < 0.1
