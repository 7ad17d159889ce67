"""What was asked of a rig, at its limits."""

from dataclasses import replace

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.run.options import GateOptions
from rollcli.run.rig_gates import Check, check_options, run_checks, status_of
from tests.run.rigs import UNKNOWN, known, rig, sequence, short


def checked(assessed, change=None, missing="", **asked):
    return run_checks(assessed, GateOptions(**asked), missing, change)


def one(assessed, change=None, **asked):
    (check,) = checked(assessed, change, **asked)
    return check


def rolled(*means, **options):
    return rig(("a", {"roll": sequence(100, *means, **options)}))


# halves and quarters: what is on the limit is exactly there
@pytest.mark.parametrize(
    ("value", "within", "ok"),
    [
        (1.5, 0.5, None),
        (0.5, 0.5, None),
        (1.75, 0.5, None),
        (1.875, 0.5, False),
        (1.25, 0.5, True),
        (0.75, 0.5, True),
        (1.0, 0.0, None),
        (-1.0, 0.5, False),
    ],
)
def test_a_roll_is_told_where_all_that_its_interval_allows_lies_on_one_side(value, within, ok):
    check = one(rolled(known(value, 0.25)), expect_roll=1.0, within=within)
    assert (check.name, check.ok) == ("expect-roll", ok)
    limit = f"{within:g}° from 1°"
    said = {
        True: f", at most {limit}",
        False: f", more than {limit}",
        None: f", which may be more or less than {limit}",
    }
    assert check.message == f"the roll of a/0 to a/99 is {value:+.2f} ± 0.25°{said[ok]}"


def test_both_ends_of_a_drift_have_to_be_as_expected():
    drifted = sequence(100, known(0.5, 0.1), drift=known(1.0, 0.1), drifts=True)
    ends = replace(drifted.segments[0], begin=known(0.0, 0.1), end=known(1.0, 0.1))
    assessed = rig(("a", {"roll": replace(drifted, segments=(ends,))}))
    for wanted, frame in ((0.0, "a/99"), (1.0, "a/0")):
        check = one(assessed, expect_roll=wanted, within=0.5)
        assert check.ok is False
        assert check.message.startswith(f"the roll at {frame} is")
    assert one(assessed, expect_roll=0.5, within=0.75).ok


def test_the_exit_status_is_that_of_the_worst_check():
    checks = [Check("a", True, ""), Check("b", None, ""), Check("c", False, "")]
    assert [int(status_of(checks[:count])) for count in range(4)] == [0, 0, 5, 4]


def test_the_rig_is_expected_as_it_is_after_the_last_jump():
    jumped = rolled(known(9.0, 0.1), known(1.0, 0.1), jumps=[(40, known(-8.0, 0.1))])
    check = one(jumped, expect_roll=1.0, within=0.5)
    assert check.ok
    assert check.message.startswith("the roll of a/40 to a/99 is +1.00")


def test_every_drive_has_to_be_as_expected_and_the_failures_are_told():
    drives = [("a", 1.0), ("b", 3.0), ("c", 1.45), ("d", -3.0)]
    assessed = rig(*((name, {"roll": sequence(50, known(value, 0.1))}) for name, value in drives))
    check = one(assessed, expect_roll=1.0, within=0.5)
    assert check.ok is False
    assert [part.partition(" is ")[0] for part in check.message.split("; ")] == [
        "the roll of b/0 to b/49",
        "the roll of d/0 to d/49",
    ]
    kept = rig(*((name, {"roll": sequence(50, known(value, 0.1))}) for name, value in drives[::2]))
    check = one(kept, expect_roll=1.0, within=0.5)
    assert check.ok is None
    assert check.message.startswith("the roll of c/0 to c/49 is")
    assert one(kept, expect_roll=1.0, within=5.0).ok


def test_pitch_and_height_are_checked_by_themselves_in_their_units():
    quantities = {
        "roll": sequence(100, known(0.0, 0.1)),
        "pitch": sequence(100, known(2.0, 0.1)),
        "height": sequence(100, known(1.5, 0.01)),
    }
    assessed = rig(("a", quantities))
    asked = {"expect_roll": 0.0, "expect_pitch": 1.0, "expect_height": 1.0, "within": 0.75}
    names = [(each.name, each.ok) for each in checked(assessed, **asked)]
    assert names == [("expect-roll", True), ("expect-pitch", False), ("expect-height", True)]
    *_, height = checked(assessed, **asked, within_height=0.25)
    assert not height.ok
    assert height.message == "the height of a/0 to a/99 is 1.50 ± 0.01 m, more than 0.25 m from 1 m"
    without = one(rolled(known(0.0, 0.1)), expect_pitch=0.0, within=9.0)
    assert (without.ok, without.message) == (None, "the pitch of a/0 to a/99 is unknown: no frame counts")


def test_what_has_no_interval_is_not_told():
    check = one(rolled(short(1.0), values=np.arange(100)), expect_roll=1.0, within=5.0)
    assert check.ok is None
    assert check.message == (
        "the roll of a/0 to a/99 is +1.00°: 100 frames, which spread over 99.00; an interval takes 8"
    )
    assert one(rig(), expect_roll=1.0, within=5.0) == Check("expect-roll", None, "there are no frames")


@pytest.mark.parametrize(("drift", "ok"), [(0.5, None), (-0.5, None), (0.25, True), (-1.0, False)])
def test_a_drift_is_limited_to_both_sides(drift, ok):
    check = one(rolled(known(0.0, 0.1), drift=known(drift, 0.125)), max_drift=0.5)
    assert (check.name, check.ok) == ("max-drift", ok)
    assert check.message.startswith(f"the drift over a/0 to a/99 is {drift:+.2f} ± 0.12°, ")


def test_a_drift_that_is_not_known_is_not_told():
    check = one(rolled(), max_drift=90.0)
    assert check == Check("max-drift", None, "the drift over a/0 to a/99: no frame counts")


def test_the_largest_jump_counts_whichever_its_sign():
    jumps = [(20, known(0.5, 0.1)), (40, known(-1.5, 0.1)), (60, known(1.0, 0.1))]
    jumped = rolled(*[known(0.0, 0.1)] * 4, jumps=jumps)
    check = one(jumped, max_jump=1.0)
    assert (check.name, check.ok) == ("max-jump", False)
    assert check.message == "the jump at a/40 is -1.50 ± 0.10°, more than 1°"
    assert one(jumped, max_jump=1.75).ok


def test_no_jump_is_told_only_where_frames_are_enough_to_see_one():
    assert one(rolled(known(0.0, 0.1)), max_jump=1.0) == Check("max-jump", True, "a/0 to a/99 hold no jump")
    few = one(rolled(short(0.0)), max_jump=1.0)
    assert few.ok is None
    assert few.message.startswith("the jumps of a/0 to a/99: 100 frames, which spread over 0.00")
    none = one(rolled(), max_jump=1.0)
    assert (none.ok, none.message) == (None, "the jumps of a/0 to a/99: no frame counts")


def test_a_change_against_another_result_is_a_jump():
    still = rolled(known(0.0, 0.1))
    moved = one(still, known(1.5, 0.1), max_jump=1.0)
    assert not moved.ok
    assert moved.message == "the change against the other result is +1.50 ± 0.10°, more than 1°"
    assert one(still, known(0.25, 0.1), max_jump=1.0).ok
    unsure = one(still, short(0.0), max_jump=1.0)
    assert unsure.message == "the change against the other result: too few frames"
    assert not one(still, UNKNOWN, max_jump=1.0).ok


@pytest.mark.parametrize(("least", "ok"), [(0.75, True), (0.7501, False), (0.0, True), (1.0, False)])
def test_the_share_of_ok_frames_is_at_least_what_was_asked(least, ok):
    states = np.arange(100) % 4 > 0
    assessed = rig(("a", {"roll": sequence(100, known(0.0, 0.1))}), ok=states, suspect=~states)
    check = one(assessed, min_ok=least)
    assert (check.name, check.ok) == ("min-ok", ok)
    said = "75 of 100 frames are ok, 75 %"
    assert (
        check.message == said
        if ok
        else check.message.startswith(f"{said}, fewer than {100 * least:.4g} %; not: a/0")
    )
    assert not one(rig(), min_ok=0.0).ok


def test_checks_are_in_the_order_of_the_options_and_what_is_missing_comes_first():
    asked = {"expect_roll": 0.0, "within": 1.0, "max_drift": 1.0, "max_jump": 1.0, "min_ok": 1.0}
    assessed = rolled(known(0.0, 0.1), drift=known(0.0, 0.1))
    names = ["expect-roll", "max-drift", "max-jump", "min-ok"]
    assert [each.name for each in checked(assessed, **asked)] == names
    halved = checked(assessed, missing="half of it is missing", **asked)
    assert [each.name for each in halved] == ["complete", *names]
    assert halved[0] == Check("complete", None, "half of it is missing")
    assert checked(assessed, missing="half of it is missing") == []


def test_one_frame_is_named_once():
    assessed = rig(("a", {"roll": sequence(1, known(0.001, 0.1))}))
    check = one(assessed, expect_roll=0.0, within=1.0)
    assert check.message.startswith("the roll of a/0 is 0.00")


@pytest.mark.parametrize(
    ("asked", "needs"),
    [
        ({"expect_roll": 0.0}, "need --within DEG"),
        ({"expect_pitch": 0.0}, "need --within DEG"),
        ({"expect_pitch": 0.0, "within_height": 1.0}, "need --within DEG"),
        ({"expect_height": 1.0}, "needs --within-height M"),
        ({"within": 1.0}, "--within needs"),
        ({"within_height": 1.0}, "--within-height needs"),
        ({"within_height": 1.0, "within": 1.0, "expect_roll": 0.0}, "--within-height needs"),
    ],
)
def test_an_expectation_without_a_tolerance_is_refused_and_the_other_way_round(asked, needs):
    with pytest.raises(UsageError, match=needs):
        check_options(GateOptions(**asked))
