"""Vertical disparities, their fit and the first look, against what synthetic views were warped by."""

import cv2
import numpy as np
import pytest

from rollcli.stereo import first_look as first_looks
from rollcli.stereo import row_fit
from rollcli.stereo.alignment import Measured, SmallViews, Texture, measure_misalignment, textured_share
from rollcli.stereo.first_look import FirstLook, first_look, look_for_range
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.row_fit import SeenBlocks

SHAPE = (160, 240)


def texture_of(shape=SHAPE, seed=0):
    noise = np.random.default_rng(seed).uniform(0, 255, shape).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.5)
    return np.clip(127 + 4 * (smooth - 127), 0, 255).astype(np.uint8)


def warped(view, lies, disparity=0.0):
    """The right view of a wall: at each place the grey that the level view has where it comes from."""
    height, width = view.shape
    v, u = np.mgrid[:height, :width].astype(np.float64)
    x, y = u - (width - 1) / 2, v - (height - 1) / 2
    at_x, at_y = x, y
    for _ in range(20):  # the fixed point: (at_x, at_y) of the level view lies at (x, y) of this one
        at_x = x - lies.scale * at_x + lies.rotation * at_y
        at_y = y - lies.offset - lies.rotation * at_x - lies.scale * at_y - lies.twist * at_x * at_y
    at = at_x + (width - 1) / 2 + disparity, at_y + (height - 1) / 2
    places = (each.astype(np.float32) for each in at)
    return cv2.remap(view, *places, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)


def wall(disparity=10.0, shape=SHAPE):
    return np.full(shape, disparity, np.float32)


@pytest.mark.parametrize(
    "lies",
    [
        Misalignment(0.4),
        Misalignment(-0.7),
        Misalignment(rotation=0.004),
        Misalignment(rotation=-0.003),
        Misalignment(scale=0.005),
        Misalignment(scale=-0.006),
        Misalignment(twist=5e-5),
        Misalignment(-0.3, 0.003, -0.004, -4e-5),
    ],
)
def test_what_a_view_was_warped_by_is_measured(lies):
    left = texture_of()

    found = measure_misalignment(Texture.of((left, warped(left, lies, 10))), wall(), rounds=4)

    within = 0.01 + 0.05 * lies.reach(*SHAPE)  # a last step below 0.1 px is not checked by another
    assert found.misalignment.shifts(*SHAPE) == pytest.approx(lies.shifts(*SHAPE), abs=within)
    assert found.share > 0.85
    assert found.spread < 0.05
    assert max(map(abs, found.errors.shifts(*SHAPE))) < 0.02


def test_a_view_that_is_levelled_in_part_is_measured_as_a_whole():
    left, lies = texture_of(), Misalignment(2.5, 0.01)

    found = measure_misalignment(Texture.of((left, warped(left, lies, 10))), wall(), Misalignment(2.2, 0.011))

    assert found.misalignment.shifts(*SHAPE) == pytest.approx(lies.shifts(*SHAPE), abs=0.02)


@pytest.mark.parametrize("noise", [0.0, 10.0, 15.0])
def test_a_disparity_that_hides_the_offset_is_taken_back(noise):
    """Slanted stripes 0.4 px lower look like ones 0.4 px further along the row, and are matched there."""
    stripes = cv2.warpAffine(
        texture_of((400, 800)), np.array([[1.0, 1.0, -200], [0, 4.0, -400]]), SHAPE[::-1]
    )
    right = warped(stripes, Misalignment(0.4), 10)
    offsets = []
    for rng in map(np.random.default_rng, range(20)):
        noisy = (view + noise * rng.standard_normal(SHAPE) for view in (stripes, right))
        views = tuple(np.clip(np.rint(view), 0, 255).astype(np.uint8) for view in noisy)
        offsets.append(measure_misalignment(Texture.of(views), wall(10.4), rounds=30).misalignment.offset)

    assert np.mean(offsets) == pytest.approx(0.4, abs=0.03)
    assert offsets == pytest.approx([0.4] * 20, abs=0.1)


@pytest.mark.parametrize("shape", [(7, 100), (100, 7)])
def test_views_smaller_than_a_block_tell_nothing(shape):
    view = texture_of(shape)
    assert measure_misalignment(Texture.of((view, view)), wall(1, shape)) is None
    assert textured_share(view) == 0


def test_the_share_with_texture_is_that_of_the_blocks_which_have_some():
    noise = texture_of((80, 80))
    assert textured_share(noise) == 1
    assert textured_share(noise[:8, :8]) == 1
    assert textured_share(np.full((80, 80), 90, np.uint8)) == 0
    half = noise.copy()
    half[36:] = 127
    half[:40] = cv2.normalize(noise[:40], None, 30, 220, cv2.NORM_MINMAX)
    half[40:] = half[39]  # columns of one grey each, as a fence: no gradient down
    assert textured_share(half) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("slope", "share"), [(0.0, 1.0), (1.0, 0.0), (-2.0, 0.0)])
def test_straight_edges_tell_only_where_they_lie_along_the_rows(slope, share):
    v, u = np.mgrid[:800, :800]
    edges = 127 + 100 * np.sin((v + slope * u) / 2.5)
    assert textured_share(edges.astype(np.uint8)) == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize(
    ("scale", "offset", "most"),
    [(0.002, 0.3, 0.004), (0.0, 0.04, 0.006), (0.0, 0.12, 0.004), (0.0, 0.5, 0.006)],
)
def test_what_lies_between_pixels_is_measured_without_a_pull_to_whole_ones(scale, offset, most):
    rng = np.random.default_rng(3)
    waves = rng.uniform(-1.6, 1.6, (60, 2))  # rad/px: as fine as cameras resolve
    phases, heights = rng.uniform(0, 2 * np.pi, 60), rng.uniform(2, 8, 60)
    v, u = np.mgrid[:240, :320].astype(float)

    def seen(u, v):
        grey = np.full(u.shape, 128.0)
        for (across, down), phase, height in zip(waves, phases, heights, strict=True):
            grey += height * np.sin(across * u + down * v + phase)
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)

    shift = 12.0
    x, y = u - 159.5, v - 119.5
    # where the right camera sees a pixel of its own: its point of the level view
    level_x, level_y = x / (1 + scale), (y - offset) / (1 + scale)
    views = seen(u, v), seen(level_x + 159.5 + shift, level_y + 119.5)
    found = measure_misalignment(Texture.of(views), np.full(u.shape, shift, np.float32), rounds=8)
    assert found.misalignment.scale == pytest.approx(scale, abs=5e-5)
    assert found.misalignment.offset == pytest.approx(offset, abs=most)  # linearly 0.08
    assert found.misalignment.twist * 160 * 120 == pytest.approx(0, abs=0.006)


def seen_at(lies, noise=0.0, count=400, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-150, 150, count), rng.uniform(-80, 80, count)
    shift = lies.down(x, y)
    shift += rng.normal(0, 1, count) * noise
    weight, near = rng.uniform(2, 50, count), rng.uniform(0, 60, count)
    parts = x, y, near, shift, weight
    return SeenBlocks(*(part.astype(np.float32) for part in parts))


def test_a_fit_without_noise_is_exact_and_outliers_do_not_move_it():
    lies = Misalignment(0.5, -0.004, 0.006, 5e-5)
    seen = seen_at(lies)
    exact = row_fit.fit_rows(seen)
    assert exact.lies.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-4)
    assert exact.spread == pytest.approx(0.001, abs=2e-4)
    seen.shift[::6] += 5
    robust = row_fit.fit_rows(seen).lies
    assert robust.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-2)


@pytest.mark.parametrize("seed", range(8))
def test_a_fit_has_settled(seed):
    """Weighed by how far off they are from it, the blocks give it again: it depends on no way there."""
    seen = seen_at(Misalignment(0.1, 0.001, 0.001), count=900)
    seen = seen._replace(
        shift=seen.shift + 0.2 * np.random.default_rng(seed).standard_t(1.5, 900).astype(np.float32)
    )
    lies = row_fit.fit_rows(seen).lies

    off = (seen.shift - lies.down(seen.x, seen.y)).astype(np.float64)
    weight = seen.weight / np.square(1 + np.square(off / (1.5 * 1.4826 * np.median(np.abs(off)))))
    parts = np.stack([np.ones(900), seen.x / 150, seen.y / 80, seen.x * seen.y / 12000])
    step = np.linalg.solve((parts * weight) @ parts.T, parts @ (weight * off))
    assert np.abs(step).max() < 0.004


def blocks_of(rng, field, *, below_horizon=False, noise=0.1, count=1500):
    """Blocks of a street: a road, and walls of any distance to both sides."""
    x, y = rng.uniform(-600, 600, count), rng.uniform(-20 if below_horizon else -180, 180, count)
    road = 0.32 * np.maximum(y + 10, 3)
    wall = np.abs(x) * rng.uniform(0.03, 0.15, count)
    near = np.where(rng.random(count) < (1.0 if below_horizon else 0.4), road, np.maximum(road, wall))
    shift = field(x, y, near) + noise * rng.normal(size=count)
    parts = x, y, near, shift, np.full(count, 20.0)
    return SeenBlocks(*(part.astype(np.float32) for part in parts))


@pytest.mark.parametrize(("offset", "share"), [(4.0, 1.0), (-4.0, 1.0), (0.0, 0.0)])
def test_rows_curve_as_far_as_their_offset_may_be_a_pitch(offset, share):
    curve = 4.0 / (0.7 * 1200) ** 2 * (np.sign(offset) or 1)  # 0.18 px in the first and the last row
    seen = blocks_of(np.random.default_rng(5), lambda x, y, near: offset + curve * y**2, noise=0.2)
    lies = LEVEL
    for _ in range(4):  # as rounds of measuring do
        left = seen.shift - lies.down(seen.x, seen.y)
        lies += row_fit.fit_rows(seen._replace(shift=left), lies).lies
    assert lies.curve == pytest.approx(share * curve, abs=0.2 * abs(curve))
    assert lies.offset == pytest.approx(offset + (1 - share) * curve * 180**2 / 3, abs=0.03)


def support_of(field, axis=(0.0, 0.0), **street):
    seen = blocks_of(np.random.default_rng(5), field, **street)
    rows = row_fit.MeasuredRows(seen, LEVEL, (375, 1242))
    return row_fit.column_support(row_fit.column_evidence(rows, 0.1), axis)


@pytest.mark.parametrize("scale", [-0.005, -0.002, 0.001, 0.002, 0.005])
def test_a_scale_that_near_and_far_and_both_halves_show_is_in_the_columns(scale):
    found = support_of(lambda x, y, near: scale * y)
    assert found.scale == pytest.approx(scale, abs=0.0002)
    assert found.error < 0.001


@pytest.mark.parametrize(
    "field",
    [lambda x, y, near: 0.005 * near, lambda x, y, near: 0.0015 * np.maximum(y, 0)],
    ids=["tilt", "bend"],
)
def test_a_tilt_and_a_bend_are_in_no_column(field):
    assert abs(support_of(field).scale) < 0.0002


def test_what_a_plain_road_cannot_tell_apart_is_doubted():
    told, plain = (support_of(lambda x, y, near: 0.001 * y, below_horizon=each) for each in (False, True))
    assert plain.error > 2 * told.error
    left_rolled = support_of(lambda x, y, near: 0.008 * (x + near), below_horizon=True)
    assert abs(left_rolled.scale) < 1.2 * left_rolled.error  # standard errors; 1.6 where that is no cause


@pytest.mark.parametrize("pitch_deg", [-0.2, 0.2])
def test_an_offset_is_a_pitch_where_its_rows_curve_as_those_of_one(pitch_deg):
    focal, turn = 0.6 * 1242, np.radians(pitch_deg)
    curve = turn / focal
    found = support_of(lambda x, y, near: turn * focal + curve * y**2)
    assert found.pitch == pytest.approx(curve, rel=0.2)
    assert abs(support_of(lambda x, y, near: turn * focal + 0 * y).pitch) < 0.1 * abs(curve)


@pytest.mark.parametrize("bend", [-0.002, 0.002])
def test_a_bend_that_a_plain_road_cannot_tell_from_a_scale_is_in_the_error(bend):
    found = support_of(lambda x, y, near: bend * np.maximum(y, 0), below_horizon=True)
    assert 1.96 * found.error > abs(found.scale) > 0.5 * abs(bend)


def test_rows_that_are_skewed_alone_are_in_the_error():
    skew = 1.4 / (600 * 180)
    found = support_of(lambda x, y, near: skew * x * y)
    assert 1.96 * found.error > found.twist * 0.15 * 375  # twice an eighth of the height: a lane's middle
    level = support_of(lambda x, y, near: 0 * x)
    assert found.error > 2 * level.error


@pytest.mark.parametrize("way", [-0.03, 0.03])
def test_what_a_rig_moves_on_by_between_its_views_is_in_the_error(way):
    factor = way / (720 * 0.54)  # over focal length and baseline: it moves points by (x, y) times d
    found = support_of(lambda x, y, near: factor * y * near)
    lane = 0.32 * 100  # px: the road's disparity half way down to the lower edge
    assert 1.96 * found.error > abs(factor) * lane > 10 * support_of(lambda x, y, near: 0 * x).error


def test_an_even_twist_is_a_yaw_and_an_uneven_one_mostly_a_lens():
    yaw = np.radians(0.2) / 720
    even = support_of(lambda x, y, near: yaw * x * y)
    aside = support_of(lambda x, y, near: yaw * (x - 120) * (y - 30), axis=(120.0, 30.0))
    assert (even.twist, aside.twist, aside.scale) == pytest.approx((yaw, yaw, -240 * yaw), rel=0.1)
    lens = support_of(lambda x, y, near: yaw * x * y + 0.2 * (x / 600) ** 2 - 0.2 * (y / 180) ** 3)
    assert abs(lens.twist) < 0.5 * yaw
    assert lens.error > even.error


def pair_of(disparity, lower=0, shape=(240, 640)):
    texture = texture_of((shape[0] + 40, shape[1] + 400), seed=9)
    rows = slice(20, 20 + shape[0])
    left = texture[rows, 200 : 200 + shape[1]]
    right = texture[20 - lower : 20 - lower + shape[0], 200 + disparity : 200 + disparity + shape[1]]
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


# glare in the left view from a column on may hide the half that a wide search sees
@pytest.mark.parametrize(
    ("disparity", "glare"), [*((each, 640) for each in (8, 30, 60, 120, 200)), (8, 320), (30, 320)]
)
def test_the_range_holds_what_is_there_and_a_tenth_more_also_beside_glare(disparity, glare):
    left, right = pair_of(disparity)
    left[:, glare:] = 255
    assert 1.1 * disparity + 5 <= look_for_range((left, right)).range <= 1.1 * disparity + 12


def test_where_nothing_is_matched_no_range_is_found():
    flat = np.full((240, 640), 90, np.uint8)
    assert look_for_range((flat, flat)) == FirstLook(None, None)
    look = first_look(SmallViews((flat, flat)))
    assert look.range is None
    assert look.measured is None


@pytest.mark.parametrize("lower", [-6, -3, 0, 3, 6])
def test_a_look_finds_how_far_the_right_view_lies_off(lower):
    look = first_look(SmallViews(pair_of(40, lower)))

    assert look.measured.misalignment.offset == pytest.approx(lower, abs=0.12)
    assert look.measured.misalignment.rotation == pytest.approx(0, abs=0.0006)
    assert look.measured.misalignment.scale == pytest.approx(0, abs=0.002)
    assert (look.measured.misalignment == LEVEL) == (lower == 0)
    assert 49 <= look.range <= 56


def test_views_too_narrow_to_search_have_no_disparities():
    narrow = texture_of((40, 20))
    assert not first_looks._match((narrow, narrow), 8).any()
    wide = pair_of(8, shape=(40, 120))
    assert np.median(first_looks._match(wide, 8.2)[:, 40:100]) == pytest.approx(8, abs=0.1)


def measured(offset=0.0, scale=0.0, error=0.01, spread=0.1, rotation=0.0):
    return Measured(Misalignment(offset, rotation, scale), Misalignment(error), 0.5, spread, None)


@pytest.mark.parametrize(
    ("coarse", "fine", "sure"),
    [
        (measured(), measured(), True),
        (measured(), None, False),
        (measured(), measured(scale=0.0029, error=1.0), True),
        (measured(9), measured(scale=0.0029), True),
        (measured(scale=0.0031), measured(scale=0.0031), True),
        (measured(scale=-0.0031), measured(scale=-0.0031, error=0.015), False),
        (measured(scale=0.0031), measured(scale=0.0031, error=0.0135), True),
        (measured(1.1, scale=0.0031), measured(0.0, scale=0.0031), True),
        (measured(1.3, scale=0.0031), measured(0.0, scale=0.0031), False),
    ],
)
def test_an_unusual_scale_is_sure_where_blocks_and_views_agree(coarse, fine, sure):
    assert first_looks._is_sure(coarse, fine, SHAPE) == sure


def test_smoothed_views_and_their_gradients_are_exact_so_every_opencv_has_the_same():
    views = tuple(np.random.default_rng(seed).integers(0, 256, (40, 56), dtype=np.uint8) for seed in (1, 2))

    found = Texture.of(views)

    def filtered(image, across, down):
        """Whole numbers in float64, which lose nothing."""
        wide = np.apply_along_axis(np.convolve, 1, image, across[::-1], "valid")
        return np.apply_along_axis(np.convolve, 0, wide, down[::-1], "valid")

    smooth, odd = np.array([1, 6, 1]), np.array([4, 4])
    left, right = (filtered(view.astype(float), smooth, smooth) for view in views)
    between = filtered(views[1].astype(float), odd, odd)
    np.testing.assert_array_equal(found.left[1:-1, 1:-1] * 8.0**2, left)
    np.testing.assert_array_equal(found.right[2:-2:2, 2:-2:2] * 8.0**2, right)
    np.testing.assert_array_equal(found.right[1:-1:2, 1:-1:2] * 8.0**2, between)
    np.testing.assert_array_equal(found.across[2:-2, 2:-2] * 8.0**3, filtered(left, [-1, 0, 1], [1, 2, 1]))
    np.testing.assert_array_equal(found.down[2:-2, 2:-2] * 8.0**3, filtered(left, [1, 2, 1], [-1, 0, 1]))
