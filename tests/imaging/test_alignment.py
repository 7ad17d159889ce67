"""A vertical offset between the views is measured and taken away, so that it does not pass for a roll."""

import math

import cv2
import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.estimator.estimate import estimate_roll
from rollcli.imaging.alignment import moved_up, vertical_offset
from rollcli.imaging.stereo import StereoOptions, match_pair
from rollcli.simulate.render import render_frame
from rollcli.simulate.spec import FrameSpec

ROLL = math.radians(-3)


@pytest.fixture(scope="module", params=["open", "street"])
def frame(request):
    return render_frame(FrameSpec(scene=request.param, roll=ROLL, seed=31, colour=False))


def lowered(view, offset):
    """The view as a camera sees it that looks up by a few pixels; by another way than the program's."""
    rows = np.arange(view.shape[0], dtype=np.float32)[:, None] - np.float32(offset)
    columns = np.arange(view.shape[1], dtype=np.float32)[None, :]
    maps = map(np.ascontiguousarray, np.broadcast_arrays(columns, rows))
    return cv2.remap(view, *maps, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)


@pytest.mark.parametrize("offset", [-1.2, -0.6, 0.3, 0.6, 1.2])
def test_an_offset_is_found_and_taken_away(frame, offset):
    level = match_pair(frame.left, frame.right, StereoOptions())
    match = match_pair(frame.left, lowered(frame.right, offset), StereoOptions())

    # it ends when less than 0.15 px shows, and a map hides up to a quarter
    assert match.vertical_offset == pytest.approx(offset, abs=0.2)
    both = (match.disparity > 0) & (level.disparity > 0)
    assert both.mean() > 0.95 * (level.disparity > 0).mean()
    assert np.median(np.abs(match.disparity - level.disparity)[both]) < 0.1


def test_a_level_pair_is_left_as_it_is(frame):
    match = match_pair(frame.left, frame.right, StereoOptions())

    assert match.vertical_offset == 0
    given = match_pair(frame.left, frame.right, StereoOptions(vertical_offset=0.0))
    np.testing.assert_array_equal(match.disparity, given.disparity)


def test_the_roll_no_longer_depends_on_the_offset(frame):
    def roll_deg(offset, **options):
        match = match_pair(frame.left, lowered(frame.right, offset), StereoOptions(**options))
        return math.degrees(estimate_roll(match.disparity).theta)

    turned = abs(roll_deg(0.8, vertical_offset=0.0) - roll_deg(-0.8, vertical_offset=0.0))
    assert abs(roll_deg(0.8) - roll_deg(-0.8)) < turned / 4
    assert abs(roll_deg(0.8) - math.degrees(ROLL)) < 0.1


def test_an_offset_that_is_given_is_not_measured(frame):
    match = match_pair(frame.left, lowered(frame.right, 0.6), StereoOptions(vertical_offset=0.5))

    assert match.vertical_offset == 0.5


def test_brightness_is_no_offset(frame):
    level = match_pair(frame.left, frame.right, StereoOptions()).disparity
    brighter = np.clip(frame.right.astype(np.float32) * 1.1 + 12, 0, 255).astype(np.uint8)

    assert abs(vertical_offset(frame.left, brighter, level)) < 0.1


def test_views_without_edges_tell_nothing():
    plain = np.full((80, 200), 90, np.uint8)

    assert vertical_offset(plain, plain, np.full((80, 200), 5, np.float32)) == 0
    assert vertical_offset(plain, plain, np.zeros((80, 200), np.float32)) == 0


def test_moving_by_whole_pixels_moves_rows():
    view = np.random.default_rng(0).integers(0, 256, (20, 30), dtype=np.uint8)

    np.testing.assert_array_equal(moved_up(view, 2)[:-2], view[2:])
    np.testing.assert_array_equal(moved_up(view, -1)[1:], view[:-1])


@pytest.mark.parametrize("offset", [-101, 100.5, math.nan])
def test_an_offset_that_cannot_be_is_refused(offset):
    with pytest.raises(UsageError, match="vertical-offset"):
        StereoOptions(vertical_offset=offset)
