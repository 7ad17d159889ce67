"""How the right view lies, fitted to blocks that are made up, against what these were made of."""

import numpy as np
import pytest

from rollcli.stereo import row_fit
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.row_fit import SeenBlocks


def seen_at(lies, noise=0.0, count=400, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-150, 150, count), rng.uniform(-80, 80, count)
    shift = lies.offset + lies.rotation * x + lies.scale * y + lies.twist * x * y
    shift += rng.normal(0, 1, count) * noise
    weight, near = rng.uniform(2, 50, count), rng.uniform(0, 60, count)
    parts = x, y, near, shift, weight
    return SeenBlocks(*(part.astype(np.float32) for part in parts))


def test_a_fit_without_noise_is_exact_and_outliers_do_not_move_it():
    lies = Misalignment(0.5, -0.004, 0.006, 5e-5)
    seen = seen_at(lies)
    exact, _, spread = row_fit.fit_rows(seen)
    assert exact.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-4)
    assert spread == pytest.approx(0.001, abs=2e-4)
    seen.shift[::6] += 5
    robust, _, _ = row_fit.fit_rows(seen)
    assert robust.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-2)


def test_the_errors_of_a_fit_are_whites_for_weighted_least_squares():
    seen = seen_at(Misalignment(0.5, -0.004, 0.006, 5e-5), noise=0.2)
    found, errors, spread = row_fit.fit_rows(seen)

    x, y = seen.x.astype(float), seen.y.astype(float)
    columns = np.stack([np.ones_like(x), x, y, x * y], axis=1)
    off = seen.shift - columns @ [found.offset, found.rotation, found.scale, found.twist]
    weight = seen.weight / (1 + (off / (1.5 * spread)) ** 2) ** 2
    inverse = np.linalg.inv(columns.T @ (columns * weight[:, None]))
    middle = columns.T @ (columns * ((weight * off) ** 2)[:, None])
    expected = np.sqrt(np.diag(inverse @ middle @ inverse))
    np.testing.assert_allclose(
        [errors.offset, errors.rotation, errors.scale, errors.twist], expected, rtol=0.01
    )
    assert spread == pytest.approx(0.2, rel=0.1)
    best = inverse @ (columns.T @ (weight * seen.shift))
    assert found.shifts(160, 300) == pytest.approx(Misalignment(*best).shifts(160, 300), abs=5e-3)


def blocks_of(rng, field, *, below_horizon=False, noise=0.1, count=1500):
    """Blocks of a street: a road, and walls of any distance to both sides."""
    x, y = rng.uniform(-600, 600, count), rng.uniform(-20 if below_horizon else -180, 180, count)
    road = 0.32 * np.maximum(y + 10, 3)
    wall = np.abs(x) * rng.uniform(0.03, 0.15, count)
    near = np.where(rng.random(count) < (1.0 if below_horizon else 0.4), road, np.maximum(road, wall))
    shift = field(x, y, near) + noise * rng.normal(size=count)
    parts = x, y, near, shift, np.full(count, 20.0)
    return SeenBlocks(*(part.astype(np.float32) for part in parts))


def support_of(field, **street):
    seen = blocks_of(np.random.default_rng(5), field, **street)
    return row_fit.column_support(
        row_fit.column_evidence(row_fit.MeasuredRows(seen, LEVEL, (375, 1242)), 0.1)
    )


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


def test_an_even_twist_is_a_yaw_and_an_uneven_one_mostly_a_lens():
    yaw = np.radians(0.2) / 720
    even = support_of(lambda x, y, near: yaw * x * y)
    assert even.twist == pytest.approx(yaw, rel=0.1)
    lens = support_of(lambda x, y, near: yaw * x * y + 0.2 * (x / 600) ** 2 - 0.2 * (y / 180) ** 3)
    assert abs(lens.twist) < 0.5 * yaw
    assert lens.error > even.error
