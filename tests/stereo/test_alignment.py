"""A right view that is shifted, turned or enlarged is levelled, so that it does not pass for a roll."""

import json
import math

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from rollcli.stereo.alignment import Approach, level
from rollcli.stereo.match import StereoOptions, match_pair
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.views import resampled
from tests.odd_views import seen_by, seen_turned
from tests.real_pairs import STREETS, needs_lidar, needs_streets, real_pairs
from tests.slow import mostly_slow

ROLL = math.radians(-3)
ODD_RIGS = [  # degrees clockwise, percent larger, pixels lower
    (0.3, 0.0, 0.0),
    (-0.8, 0.0, 0.0),
    (0.0, 0.4, 0.0),
    (0.0, -0.8, 0.0),
    (0.0, 0.0, -0.6),
    (0.0, 0.0, 4.0),
    (0.6, 0.8, -4.0),
    (-0.8, -0.4, 2.0),
]


@pytest.fixture(scope="module", params=mostly_slow(["open", "street"], "street"))
def frame(request):
    return render_frame(FrameSpec(scene=request.param, roll=ROLL, seed=31, colour=False))


def roll_deg(left, right, **options):
    return math.degrees(estimate_roll(match_pair(left, right, StereoOptions(**options)).disparity).theta)


@pytest.mark.parametrize(("clockwise_deg", "larger_percent", "lower"), ODD_RIGS)
def test_what_a_camera_was_moved_by_is_found_and_taken_away(frame, clockwise_deg, larger_percent, lower):
    odd = {"clockwise_deg": clockwise_deg, "larger_percent": larger_percent, "lower": lower}

    match = match_pair(frame.left, seen_by(frame.right, **odd), StereoOptions())

    assert math.degrees(match.corrected.rotation) == pytest.approx(clockwise_deg, abs=0.03)
    assert 100 * match.corrected.scale == pytest.approx(larger_percent, abs=0.05)
    assert match.corrected.offset == pytest.approx(lower, abs=0.15)
    found = math.degrees(estimate_roll(match.disparity).theta)
    assert found == pytest.approx(roll_deg(frame.left, frame.right), abs=0.1)


@pytest.mark.slow
def test_hardly_any_camera_that_was_moved_is_doubted():
    doubts = []
    for seed in range(101, 111):
        frame = render_frame(FrameSpec(scene="open", roll=ROLL, seed=seed, colour=False))
        for turned, larger, lower in ODD_RIGS:
            right = seen_by(frame.right, clockwise_deg=turned, larger_percent=larger, lower=lower)
            doubts.append(match_pair(frame.left, right, StereoOptions()).doubt)

    assert sum(map(bool, doubts)) < 0.1 * len(doubts)


def test_uncorrected_they_would_turn_the_road(frame):
    right = seen_by(frame.right, clockwise_deg=0.3)

    assert abs(roll_deg(frame.left, right, align="off") - roll_deg(frame.left, right)) > 0.2


@pytest.mark.slow
@pytest.mark.parametrize("larger", [(0.2, -0.4), (0.02, -0.03)])
def test_the_interval_knows_that_levelling_errs(larger):
    """Larger views of six empty roads: without what is left of it, it misses 2 and 8 of the twelve rolls."""
    rolls = np.radians(np.linspace(-8, 8, 6))
    frames = [render_frame(FrameSpec(roll=roll, seed=seed, colour=False)) for seed, roll in enumerate(rolls)]
    reached = []
    for roll, frame in zip(rolls, frames, strict=True):
        for larger_percent in larger:
            right = seen_by(frame.right, larger_percent=larger_percent)
            match = match_pair(frame.left, right, StereoOptions())
            found = estimate_roll(match.disparity, Request(slope_error=match.slope_error))
            reached.append(abs(found.theta - roll) <= found.ci95)

    assert sum(reached) >= 0.9 * len(reached)


def test_a_pair_that_was_not_measured_has_no_error_of_levelling(frame):
    assert match_pair(frame.left, frame.right, StereoOptions(align="off")).slope_error == 0
    lower = seen_by(frame.right, lower=2.0)
    assert match_pair(frame.left, lower, StereoOptions(vertical_offset=2.0)).slope_error == 0
    assert match_pair(frame.left, lower, StereoOptions()).slope_error > 0


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["open", "street"])
def test_a_yaw_is_taken_out_of_rows_and_columns(scene):
    off = []
    for seed in range(6):
        frame = render_frame(FrameSpec(scene=scene, roll=ROLL, seed=seed, colour=False))
        height, width = frame.right.shape
        rows, columns = np.mgrid[:height, :width].astype(np.float32)
        x, y = columns - (width - 1) / 2, rows - (height - 1) / 2
        skew = np.float32(1.4 / (width * height / 4))  # 1.4 px in the corners: 0.4 degrees
        right = cv2.remap(frame.right, columns - skew * x * x, rows - skew * x * y, cv2.INTER_LANCZOS4)

        match = match_pair(frame.left, right, StereoOptions())

        # less than 0.3 px in the corners counts as level
        assert match.corrected.shifts(height, width)[3] == pytest.approx(1.4, abs=0.3)
        found = math.degrees(estimate_roll(match.disparity).theta)
        off.append(abs(found - roll_deg(frame.left, frame.right)))
    assert np.median(off) < 0.05


@pytest.mark.parametrize("downscale", [1.0, 2.0])
def test_a_level_pair_is_left_as_it_is(frame, downscale):
    match = match_pair(frame.left, frame.right, StereoOptions(downscale=downscale))

    assert match.corrected == LEVEL
    assert match.doubt == ""
    options = StereoOptions(align="off", num_disparities=match.num_disparities, downscale=downscale)
    off = match_pair(frame.left, frame.right, options)
    np.testing.assert_array_equal(match.disparity, off.disparity)


@pytest.fixture(scope="module", params=mostly_slow([1, 5, 14], 5))
def empty_road(request):
    """Grain and noise: of two of these, small views say that the right one is turned and skewed."""
    specs = draw_specs(
        SimulateOptions(frames=request.param + 1, scene="bare", noise=4.0, seed=6101, grey=True)
    )
    return render_frame(specs[-1])


def test_a_level_pair_of_an_empty_road_is_left_as_it_is(empty_road):
    match = match_pair(empty_road.left, empty_road.right, StereoOptions())

    assert match.corrected == LEVEL
    assert match.doubt == ""


@pytest.mark.parametrize(("larger_percent", "lower"), [(0.2, 0.0), (0.0, 0.3), (0.0, 0.4), (0.0, -2.0)])
def test_what_a_map_of_an_empty_road_hides_is_found_or_doubted(empty_road, larger_percent, lower):
    right = seen_by(empty_road.right, larger_percent=larger_percent, lower=lower)

    match = match_pair(empty_road.left, right, StereoOptions())

    found = estimate_roll(match.disparity, Request(slope_error=match.slope_error))
    off = abs(math.radians(roll_deg(empty_road.left, empty_road.right)) - found.theta)
    # an empty road hardly tells a scale from a bend of its rows; the interval says how far
    assert match.doubt or off <= (found.ci95 if larger_percent else math.radians(0.1))


@pytest.mark.slow
def test_rows_that_are_bent_alone_are_seldom_taken_for_a_scale_without_a_word():
    """Of 48 such roads 37 are doubted, or their interval holds the truth."""
    told = 0
    for seed in range(4):
        frame = render_frame(
            FrameSpec(seed=seed, roll=math.radians(3), noise=4.0, scene="bare", colour=False)
        )
        height, width = frame.right.shape
        columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
        bent = rows + np.float32(0.002) * np.maximum(rows - (height - 1) / 2, 0).astype(np.float32)
        right = cv2.remap(frame.right, columns, bent, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)
        match = match_pair(frame.left, right, StereoOptions())
        found = estimate_roll(match.disparity, Request(slope_error=match.slope_error))
        told += bool(match.doubt) or abs(found.theta - math.radians(3)) <= found.ci95
    assert told >= 3


def test_brightness_is_no_misalignment(frame):
    brighter = np.clip(frame.right.astype(np.float32) * 1.1 + 12, 0, 255).astype(np.uint8)

    assert match_pair(frame.left, brighter, StereoOptions()).corrected == LEVEL


def test_what_is_measured_at_half_size_is_in_pixels_of_that(frame):
    match = match_pair(frame.left, seen_by(frame.right, lower=3), StereoOptions(downscale=2))

    assert match.corrected.offset == pytest.approx(1.5, abs=0.1)


@pytest.mark.slow
def test_half_the_size_is_levelled_by_what_the_given_views_tell():
    off = []
    for spec in draw_specs(SimulateOptions(frames=12, size=(640, 480), seed=5, grey=True)):
        pair = render_frame(spec)
        match = match_pair(pair.left, seen_by(pair.right, larger_percent=0.3), StereoOptions(downscale=2))
        off.append(abs(match.measured.misalignment.scale - 0.003))

    assert np.median(off) < 8.5e-5  # measured of halved views it was 9e-5 to 14e-5, by the seed


def test_an_offset_that_is_given_is_not_measured(frame):
    match = match_pair(frame.left, seen_by(frame.right, lower=0.6), StereoOptions(vertical_offset=0.5))

    assert match.corrected == Misalignment(offset=0.5)


def levelled_as_told(frame, folder, lower, **told):
    """A right view that lies so much lower, levelled as a file says that has it 1 px lower."""
    height, width = frame.left.shape[:2]
    lies = {"right_lower_px": 1.0, "right_clockwise_deg": 0, "right_larger_percent": 0, "right_twist_px": 0}
    use = folder / "use.json"
    use.write_text(json.dumps({**lies, **told, "width": width, "height": height}))
    return match_pair(frame.left, seen_by(frame.right, lower=lower), StereoOptions(align=use))


@pytest.mark.parametrize(
    ("ci95", "lower", "offset"), [(0.2, 1.15, 1.15), (0.004, 1.15, 1.0), (0.2, 2.0, 1.0)]
)
def test_the_offset_is_the_pairs_own_as_far_as_the_drive_leaves_it_open(frame, tmp_path, ci95, lower, offset):
    match = levelled_as_told(frame, tmp_path, lower, right_lower_ci95_px=ci95)

    assert match.corrected.offset == pytest.approx(offset, abs=0.03)
    assert match.corrected.shifts(*frame.left.shape[:2])[1:] == pytest.approx([0] * 5, abs=1e-3)
    assert ("as the correction says" in match.doubt) == (lower == 2)


@pytest.mark.parametrize(("pitch_error", "doubted"), [(None, False), (0.0001, False), (0.0005, True)])
def test_a_drive_that_does_not_tell_a_pitch_leaves_its_pairs_in_doubt(frame, tmp_path, pitch_error, doubted):
    columns = {"scale": 0.0, "twist": 0.0, "pitch": 0.0, "slope_error": 0.0006}
    columns |= {} if pitch_error is None else {"pitch_error": pitch_error}

    match = levelled_as_told(frame, tmp_path, 1, columns=columns)

    assert ("right camera is pitched" in match.doubt) == doubted
    assert match.slope_error == 0.0006


def moved_by_a_pitch(left, right, pitch_deg, level_deg):
    """How far a pitch of the right camera moves the angle, degrees; 0 where the pair is in doubt."""
    match = match_pair(left, seen_turned(right, pitch_deg=pitch_deg, focal=0.6), StereoOptions())
    found = math.degrees(estimate_roll(match.disparity).theta)
    return 0.0 if match.doubt else abs(found - level_deg)


@pytest.mark.parametrize("pitch_deg", [-0.3, 0.1, 0.3])
def test_a_pitch_of_the_right_camera_is_levelled_or_doubted(frame, pitch_deg):
    level_deg = roll_deg(frame.left, frame.right)
    assert moved_by_a_pitch(frame.left, frame.right, pitch_deg, level_deg) < 0.05


@pytest.mark.slow
@needs_lidar
def test_a_pitch_of_a_real_right_camera_is_levelled_or_doubted():
    """What a road and a lens have of their own looks like a pitch, too: one in ten may go wrong."""
    moved = []
    for pair in real_pairs(slice(1, None, 5)):
        match = match_pair(*pair, StereoOptions())
        assert match.doubt == ""
        level_deg = math.degrees(estimate_roll(match.disparity).theta)
        moved += [moved_by_a_pitch(*pair, pitch_deg, level_deg) for pitch_deg in (-0.3, 0.3)]
    assert np.mean(np.array(moved) < 0.1) >= 0.9


def test_a_camera_that_is_too_far_off_is_never_corrected_without_a_word(frame):
    right = seen_by(frame.right, clockwise_deg=3)

    assert match_pair(frame.left, right, StereoOptions()).doubt


def test_swapped_and_turned_views_are_told(frame):
    turned, told = seen_by(frame.right, clockwise_deg=0.4, lower=1), "swapped, mirrored or .* --min-disparity"
    for views in ((turned, frame.left), (frame.left[:, ::-1], turned[:, ::-1])):
        with pytest.raises(InputError, match=f"the views seem {told}"):
            match_pair(*views, StereoOptions())


def test_of_small_images_it_is_said_that_they_may_be_too_small(frame):
    views = (frame.left, frame.right)
    left, right = (cv2.resize(each, (80, 60), interpolation=cv2.INTER_AREA) for each in views)

    with pytest.raises(InputError, match=r"too small to compare \(80x60 px\), or do not show the same"):
        match_pair(left, right, StereoOptions())


@pytest.mark.parametrize("height", [1, 2, 7])
def test_views_of_a_few_rows_tell_nothing(frame, height):
    match = match_pair(frame.left[:height], frame.right[:height], StereoOptions())

    assert match.disparity.shape == (height, frame.left.shape[1])
    assert "to tell whether the views are level" in match.doubt


def test_who_searches_below_zero_may_swap_the_views(frame):
    match = match_pair(frame.right, frame.left, StereoOptions(min_disparity=-96, num_disparities=96))

    assert not (match.disparity > 2).mean() > 0.1  # what is below 0 is no data


def test_whole_pixels_move_rows():
    view = np.random.default_rng(0).integers(0, 256, (20, 30), dtype=np.uint8)

    np.testing.assert_array_equal(level(view, Misalignment(offset=2))[:-2], view[2:])
    np.testing.assert_array_equal(level(view, Misalignment(offset=-1))[1:], view[:-1])


def test_levelling_is_the_inverse_of_what_the_camera_did():
    rng = np.random.default_rng(1)
    view = cv2.GaussianBlur(rng.integers(0, 256, (240, 320), dtype=np.uint8), (0, 0), 3)
    odd = seen_by(view, clockwise_deg=0.8, larger_percent=0.8, lower=3)

    again = level(odd, Misalignment(offset=3, rotation=math.radians(0.8), scale=0.008))

    inside = np.s_[12:-12, 12:-12]
    assert np.abs(again[inside].astype(int) - view[inside]).max() <= 2


@needs_streets
@pytest.mark.parametrize(
    ("clockwise_deg", "larger_percent", "lower"),
    mostly_slow([(0.5, 0.0, -2.0), (-0.8, 0.8, 4.0)], (0.5, 0.0, -2.0)),
)
def test_real_street_pairs_are_levelled_by_what_was_added(clockwise_deg, larger_percent, lower):
    odd = {"clockwise_deg": clockwise_deg, "larger_percent": larger_percent, "lower": lower}
    compared = 0
    for left, right in real_pairs(slice(None, None, 6), STREETS):
        as_it_is = match_pair(left, right, StereoOptions())
        match = match_pair(left, seen_by(right, **odd), StereoOptions())

        added = match.corrected - as_it_is.corrected
        assert math.degrees(added.rotation) == pytest.approx(clockwise_deg, abs=0.03)
        assert added.offset == pytest.approx(lower, abs=0.1)
        found, before = estimate_roll(match.disparity), estimate_roll(as_it_is.disparity)
        if before.status == "ok":  # a suspect angle may be either of two planes
            assert math.degrees(found.theta - before.theta) == pytest.approx(0, abs=0.1)
            compared += 1
    assert compared >= 2


SHAPE = (200, 240)


@pytest.mark.parametrize(
    "lies",
    [
        Misalignment(12.0),
        Misalignment(-7.0),  # of half a pixel OpenCV 4 rounds every number up
        Misalignment(rotation=0.1),
        Misalignment(rotation=-0.05),
        Misalignment(scale=0.1),
        Misalignment(scale=-0.08),
        Misalignment(twist=0.001),
        Misalignment(3, 0.02, -0.05, -0.0005),
    ],
)
def test_each_pixel_comes_from_where_the_definition_says(lies):
    height, width = SHAPE
    v, u = np.mgrid[:height, :width]
    x, y = u - (width - 1) / 2, v - (height - 1) / 2
    from_v = v + lies.offset + lies.rotation * x + lies.scale * y + lies.twist * x * y
    from_u = u + lies.scale * x - lies.rotation * y

    rows, columns = level(v.astype(np.uint8), lies), level(u.astype(np.uint8), lies)

    # in the corners of an enlarged ramp the border repeats: its numbers are those of the nearest row
    np.testing.assert_allclose(rows, np.clip(from_v, 0, height - 1), atol=1)
    np.testing.assert_allclose(columns, np.clip(from_u, 0, width - 1), atol=1)
    inner = (np.abs(x) < 90) & (np.abs(y) < 70)
    assert abs((rows - from_v)[inner].mean()) < 0.05
    assert abs((columns - from_u)[inner].mean()) < 0.05


def test_a_level_view_is_not_touched():
    view = np.zeros(SHAPE, np.uint8)
    assert level(view, LEVEL) is view


@pytest.mark.parametrize("hidden", [-0.5, 0.0, 0.4, 0.66])
def test_two_measurements_tell_what_a_map_hides(hidden):
    twist = 0.8 / (SHAPE[0] * SHAPE[1] / 4)  # 0.8 px in the corners
    rig, approach, at = Misalignment(2, 0.01, -0.004, twist), Approach(SHAPE), LEVEL
    for _ in range(2):
        at = approach.next(at, rig - (rig - at).times(hidden))

    assert at.shifts(*SHAPE) == pytest.approx(rig.shifts(*SHAPE), abs=1e-4)


def test_a_map_of_another_size_is_in_its_pixels():
    v, u = np.mgrid[:40, :60].astype(np.float32)
    slope = 10 + 0.5 * u + 0.25 * v
    assert resampled(slope, (40, 60)) is slope

    small = resampled(slope, (20, 30))
    assert small.shape == (20, 30)
    np.testing.assert_array_equal(small, slope[::2, ::2] / 2)

    large = resampled(slope, (80, 120))
    v, u = np.mgrid[:80, :120]
    expected = 2 * (10 + 0.5 * ((u + 0.5) / 2 - 0.5) + 0.25 * ((v + 0.5) / 2 - 0.5))
    np.testing.assert_allclose(large[2:-2, 2:-2], expected[2:-2, 2:-2], rtol=1e-5)


@pytest.mark.parametrize("factor", [2, 3])
def test_an_enlarged_map_has_no_number_that_a_hole_is_part_of(factor):
    values = np.full((20, 30), 5, np.float32)
    values[10, 12] = 0

    large = resampled(values, (20 * factor, 30 * factor))

    assert set(np.unique(large)) == {0, 5 * factor}
    v, u = np.nonzero(large == 0)
    near = (np.abs((v + 0.5) / factor - 10.5) < 1) & (np.abs((u + 0.5) / factor - 12.5) < 1)
    assert near.all()
    v, u = np.mgrid[: 20 * factor, : 30 * factor]
    touched = (np.abs((v + 0.5) / factor - 10.5) < 0.99) & (np.abs((u + 0.5) / factor - 12.5) < 0.99)
    assert not large[touched].any()
