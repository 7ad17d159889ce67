"""One quantity over one drive, on simulated series whose truth is known; bench_rig.py counts many more."""

import numpy as np
import pytest

from rollcli.rig.drive.quantity import assess_sequence
from tests.rig.drive.series import drive
from tests.slow import mostly_slow

SEEDS = range(4)


@pytest.mark.slow
def test_a_stable_drive_has_an_interval_that_holds_and_neither_jumps_nor_drift():
    found = [assess_sequence(*drive(seed)) for seed in range(20)]
    inside = sum(abs(each.now.value + 0.44) <= each.now.ci95 for each in found)
    assert inside >= 16  # 99.7 % of all twenties where 95 % are inside
    assert sum(len(each.jumps) > 0 for each in found) <= 2


@pytest.mark.parametrize("gap", mostly_slow([0, 300], 300))  # frames before it that have no angle
@pytest.mark.parametrize("seed", SEEDS)
def test_a_jump_is_found_with_its_size_and_the_rig_is_as_it_is_after_it(seed, gap):
    values, errors = drive(seed, jump=0.8, at=1200, sd=0.1)
    values[1200 - gap : 1200] = np.nan
    found = assess_sequence(values, errors)
    (jump,) = found.jumps
    assert found.status == "jump"
    assert abs(jump.frame - 1200) <= 20
    assert abs(jump.change.value - 0.8) < 0.2
    assert abs(found.now.value - 0.36) < 0.15
    assert [(each.first, each.last) for each in found.segments] == [(0, jump.frame - 1), (jump.frame, 1999)]


def test_a_rise_and_a_fall_that_cancel_are_both_found_where_the_first_frames_have_no_angle():
    values, errors = drive(2, 120, phi=0.0, sd=0.1, errors=(0.02, 0.1))
    values[60:84] += 0.5
    values[:24] = np.nan
    assert [each.frame for each in assess_sequence(values, errors).jumps] == [60, 84]


@pytest.mark.parametrize(("seed", "frames"), [(0, 30), (10, 30), (22, 30), (0, 16), (1, 17), (2, 18)])
def test_a_jump_of_a_short_drive_is_no_kick_which_had_no_time_to_fade(seed, frames):
    found = assess_sequence(*drive(seed, frames, level=0, phi=0.0, sd=0.1, errors=(0.02, 0.1), jump=1.0))
    assert ([each.frame for each in found.jumps], found.used) == ([frames // 2], frames)


@pytest.mark.parametrize(("frames", "behind"), [(200, 7), (1000, 10)])
def test_a_jump_too_near_the_end_is_not_taken_for_one_before_it(frames, behind):
    assert not assess_sequence(*drive(0, frames, phi=0.0, sd=0.05, jump=1.0, at=frames - behind)).jumps


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("frames", [500, 1000])
def test_a_jump_that_goes_back_too_near_the_end_to_be_told_is_a_jump(frames, seed):
    values, errors = drive(seed, frames, sd=0.15, jump=1.0, at=400)
    values[-frames // 50 :] -= 1.0
    assert 390 <= assess_sequence(values, errors).jumps[0].frame <= 410


@pytest.mark.parametrize("seed", SEEDS)
def test_a_drift_is_found_and_is_no_jump(seed):
    found = assess_sequence(*drive(seed, 4000, drift=1.0, sd=0.1))
    assert (found.status, found.jumps) == ("drift", ())
    assert abs(found.drift.value - 1.0) < 2 * found.drift.ci95


@pytest.mark.slow
def test_frames_that_differ_by_degrees_seldom_have_a_drift_that_is_none():
    found = [assess_sequence(*drive(seed, 24, phi=0.0, sd=6.0)) for seed in range(20)]
    assert sum(each.status != "stable" for each in found) <= 3  # 8 where the prior of a drift is one degree


@pytest.mark.slow
def test_gross_outliers_called_ok_hardly_move_the_mean():
    of = [[assess_sequence(*drive(seed, gross=share)).now.value for seed in range(6)] for share in (0, 0.05)]
    clean, soiled = np.array(of) + 0.44
    assert np.std(soiled) <= 1.5 * np.std(clean)
    assert abs(np.mean(soiled)) <= 1.5 * max(abs(np.mean(clean)), np.std(clean) / 3)


def test_many_frames_are_averaged_and_the_jump_is_still_found_to_the_frame():
    (jump,) = assess_sequence(*drive(6, 120_000, phi=0.9, sd=0.1, jump=0.5, at=70_001)).jumps
    assert abs(jump.frame - 70_001) <= 10


@pytest.mark.parametrize(
    ("values", "errors"),
    [
        ([], []),
        ([np.nan] * 20, [0.1] * 20),
        ([1.0], [0.1]),
        ([1.0, 1.2], [np.nan, np.nan]),
        ([0.5] * 300, [0.0] * 300),
        ([0.5] * 300, [np.nan] * 300),
        ([0.0, 1.0] * 100, [0.1] * 200),
        ([1.0] + [np.nan] * 500 + [2.0], [0.1] * 502),
        ([1.0, 2.0], [0.05, 1e20]),
    ],
)
def test_few_equal_or_missing_values_are_assessed_without_complaint(values, errors):
    found = assess_sequence(values, errors)
    assert found.frames == len(values)
    assert found.used == np.isfinite(values).sum()
    assert found.now.value is None or np.nanmin(values) - 1e-9 <= found.now.value <= 2


@pytest.mark.parametrize("seed", SEEDS)
def test_frames_whose_own_errors_explain_how_far_off_they_are_are_no_outliers(seed):
    rng = np.random.default_rng(seed)
    errors = np.where(rng.random(400) < 0.1, 0.5, 0.01)
    values = rng.normal(0, 1, 400) * errors
    values[200], errors[200] = 3.0, 0.01
    assert assess_sequence(values, errors).outliers == 1


def test_a_drift_beside_a_jump_is_that_of_the_line_between_levels():
    values = np.random.default_rng(0).normal(0, 0.05, 200) + np.linspace(0, 1, 200)
    values[100:] += 2.0
    found = assess_sequence(values, np.full(200, 0.01))
    (jump,) = found.jumps
    assert (jump.frame, found.drifts, found.status) == (100, True, "jump")
    assert found.drift.value == pytest.approx(1.0, abs=found.drift.ci95)
    assert jump.change.value == pytest.approx(2.0, abs=jump.change.ci95)


def test_the_spread_between_frames_is_what_their_errors_do_not_explain():
    rng = np.random.default_rng(3)
    values = rng.normal(0, 0.3, 4000) + rng.normal(0, 0.1, 4000)
    errors = np.where(np.arange(4000) % 4, 0.1, np.nan)  # where none is known, it is the usual one
    found = assess_sequence(values, errors)
    assert found.between_sd == pytest.approx(0.3, rel=0.05)
