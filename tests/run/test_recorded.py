"""What a rig's checks and texts are, and how sessions at a prompt go; see `tests.sessions`."""

import json
from dataclasses import asdict, replace
from functools import partial

import numpy as np

from rollcli.rig.quantities import ALIGNMENT
from rollcli.run.options import GateOptions
from rollcli.run.rig_gates import Check, check_options, run_checks, status_of
from rollcli.run.rig_text import Findings, as_csv, as_json, as_table
from tests import sessions
from tests.recorded import made, recorded_test
from tests.run.rigs import UNKNOWN, known, rig, sequence, short


@sessions.parametrize("run")
def test_a_session_goes_as_it_is_written_down(tmp_path, heading):
    sessions.check("run", heading, tmp_path)


def _rolled(*means, **options):
    return rig(("a", {"roll": sequence(100, *means, **options)}))


def _drives():
    """Two drives: the first jumps, the second differs from it and has pitch and height."""
    jump, drift = [(10, known(0.5, 0.05))], {"drift": known(-0.25, 0.03), "drifts": True}
    first = {"roll": sequence(30, known(1.0, 0.1), known(1.5, 0.2), jumps=jump, drift=known(0.01, 0.03))}
    pitches = {"jumps": [(5, known(1.0, 0.1))], "values": np.repeat([3.0, 4.0], [5, 15])}
    second = {
        "roll": sequence(20, known(-2.0, 0.1), used=18, outliers=2, **drift),
        "pitch": sequence(20, known(3.0, 0.1), known(4.0, 0.1), drift=known(0.02, 0.05), **pitches),
        "height": sequence(20, known(1.65, 0.01), values=np.full(20, 1.65)),
    }
    suspect = np.isin(np.arange(50), [3, 12, 13])
    ok = ~suspect & (np.arange(50) != 49)
    return rig(("a", first), ("b", second), changes={"b": (known(-3.0, 0.1), True)}, ok=ok, suspect=suspect)


def _drifted():
    roll = sequence(100, known(0.5, 0.1), drift=known(1.0, 0.1), drifts=True)
    ends = replace(roll.segments[0], begin=known(0.0, 0.1), end=known(1.0, 0.1))
    return rig(("a", {"roll": replace(roll, segments=(ends,))}))


def _pairs(first, last):
    """A drive whose right view drifts from one height to another."""
    lower = sequence(100, known((first + last) / 2, 0.125), drifts=first != last)
    ends = replace(lower.segments[0], begin=known(first, 0.125), end=known(last, 0.125))
    still = {each.name: sequence(100, known(0.0, 0.0)) for each in ALIGNMENT[1:]}
    parts = {ALIGNMENT[0].name: replace(lower, segments=(ends,)), **still}
    return "p", {"roll": sequence(100, known(0.0, 0.1)), **parts}


def _posed():
    pitch, height = sequence(100, known(2.0, 0.1)), sequence(100, known(1.5, 0.01))
    return rig(("a", {"roll": sequence(100, known(0.0, 0.1)), "pitch": pitch, "height": height}))


def _doubted():
    fine = np.arange(100) % 4 > 0
    return rig(("a", {"roll": sequence(100, known(0.0, 0.1))}), ok=fine, suspect=~fine)


def _of_drives(*values):
    return rig(
        *((f"d{place}", {"roll": sequence(50, known(each, 0.1))}) for place, each in enumerate(values))
    )


JUMPS = [(20, known(0.5, 0.1)), (40, known(-1.5, 0.1)), (60, known(1.0, 0.1))]
JUMPED = partial(_rolled, *[known(0.0, 0.1)] * 4, jumps=JUMPS)
STILL = partial(_rolled, known(0.0, 0.1), drift=known(0.0, 0.1))
CHECKS = [Check("min-ok", True, "fine"), Check("max-jump", False, "far")]
CHANGES = {"roll": known(0.5, 0.25), "pitch": known(0.125, 0.25), "height": UNKNOWN}
# halves and quarters: what is on a limit is exactly there
GATES = {
    **{
        f"{value} ± 0.25, {within} from 1": (
            partial(_rolled, known(value, 0.25)),
            {"expect_roll": 1.0, "within": within},
        )
        for within, values in ((0.5, (1.5, 0.5, 1.75, 1.875, 1.25, 0.75, -1.0)), (0.0, (1.0,)))
        for value in values
    },
    **{f"drifted, {end}": (_drifted, {"expect_roll": end, "within": 0.5}) for end in (0.0, 1.0)},
    "drives": (partial(_of_drives, 1.0, 3.0, 1.45, -3.0), {"expect_roll": 1.0, "within": 0.5}),
    "drives that may": (partial(_of_drives, 1.0, 1.45), {"expect_roll": 1.0, "within": 0.5}),
    "drives that are": (partial(_of_drives, 1.0, 1.45), {"expect_roll": 1.0, "within": 5.0}),
    "pose": (_posed, {"expect_roll": 0.0, "expect_pitch": 1.0, "expect_height": 1.0, "within": 0.75}),
    "height": (_posed, {"expect_height": 1.0, "within_height": 0.25}),
    "no pitch": (STILL, {"expect_pitch": 0.0, "within": 9.0}),
    "no interval": (partial(_rolled, short(1.0), values=np.arange(100)), {"expect_roll": 1.0, "within": 5.0}),
    "no frames": (rig, {"expect_roll": 1.0, "within": 5.0, "min_ok": 0.0}),
    "one frame": (
        lambda: rig(("a", {"roll": sequence(1, known(0.001, 0.1))})),
        {"expect_roll": 0.0, "within": 1.0, "max_jump": 1.0},
    ),
    **{
        f"drift {drift}": (partial(_rolled, known(0.0, 0.1), drift=known(drift, 0.125)), {"max_drift": 0.5})
        for drift in (0.5, -0.5, 0.25, -1.0)
    },
    "no drift known": (_rolled, {"max_drift": 90.0, "max_jump": 1.0}),
    **{f"jumps, {most}": (JUMPED, {"max_jump": most}) for most in (1.0, 1.75)},
    "drives that differ": (_drives, {"max_jump": 2.0}),
    "too few for jumps": (partial(_rolled, short(0.0)), {"max_jump": 1.0}),
    **{f"share {least}": (_doubted, {"min_ok": least}) for least in (0.75, 0.7501, 0.0, 1.0)},
    "all": (STILL, {"expect_roll": 0.0, "within": 1.0, "max_drift": 1.0, "max_jump": 1.0, "min_ok": 1.0}),
    "pairs": (STILL, {"max_misalignment": 1.0}),
    **{
        f"pairs, {first} to {last}": (partial(rig, _pairs(first, last)), {"max_misalignment": 1.0})
        for first, last in ((2.0, 0.0), (0.5, 0.5), (0.0, 1.0), (0.0, 0.875))
    },
    "pairs off in one drive": (partial(rig, _pairs(2.0, 2.0), _pairs(0.0, 0.0)), {"max_misalignment": 1.0}),
    "no pair measured in one drive": (
        lambda: rig(_pairs(0.0, 0.0), ("b", {"roll": sequence(9)})),
        {"max_misalignment": 1.0},
    ),
}
WRONG = (
    *({"expect_roll": 0.0}, {"expect_pitch": 0.0}, {"expect_pitch": 0.0, "within_height": 1.0}),
    *({"expect_height": 1.0}, {"within": 1.0}, {"within_height": 1.0}),
    {"within_height": 1.0, "within": 1.0, "expect_roll": 0.0},
)


def _gate(make, asked, missing="", change=None):
    checks = run_checks([make()], GateOptions(**asked), missing, change)
    return [[asdict(each) for each in checks], int(status_of(checks))]


def _told(write):
    """A rig's assessment as a text; of many drives, one with nothing to say, and none."""
    made = Findings(_drives(), CHECKS, rig(("c", {"roll": sequence(7, known(0.0, 0.1), used=6)})), CHANGES)
    quiet = Findings(rig(("a", {"roll": sequence(9, known(1.0, 0.1), drift=known(0.0, 0.1))})), [], None, {})
    many = [
        Findings(
            rig(*((f"d{place}", {"roll": sequence(3, known(1.0, 0.1))}) for place in range(count))),
            [],
            None,
            {},
        )
        for count in (0, 40, 41)
    ]
    return [_cut(write(each)) for each in (made, quiet, *many)]


def _cut(told):
    """Of a long list its first and its last ones, whose numbers stay numbers."""
    return told if isinstance(told, dict) or len(told) < 60 else [*told[:3], len(told), *told[-3:]]


def _cells(findings):
    return [[_number(cell) for cell in line.split(",")] for line in as_csv(findings).splitlines()]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


TOLD = {
    "csv": _cells,
    "json": lambda findings: json.loads(as_json(findings)),
    "table": lambda findings: as_table(findings).splitlines(),
}
CASES = {
    **{f"gate: {name}": partial(_gate, make, asked) for name, (make, asked) in GATES.items()},
    **{
        f"change: {name}": partial(_gate, STILL, {"max_jump": 1.0}, change=change)
        for name, change in {
            "far": known(1.5, 0.1),
            "near": known(0.25, 0.1),
            "unsure": short(0.0),
            "unknown": UNKNOWN,
        }.items()
    },
    **{
        f"half, {asked}": partial(_gate, STILL, asked, missing="half is missing")
        for asked in ({}, {"min_ok": 1.0})
    },
    **{f"refused: {each}": partial(made, check_options, GateOptions(**each)) for each in WRONG},
    **{f"as {name}": partial(_told, write) for name, write in TOLD.items()},
}

test_answers_are_those_recorded = recorded_test("run", CASES)
