"""An assessment as programs and people read it: every number where the interface says."""

import json

import numpy as np
import pytest

from rollcli.run.rig_gates import Check
from rollcli.run.rig_text import Findings, as_csv, as_json, as_table
from tests.run.rigs import UNKNOWN, known, rig, sequence
from tests.run_cli import rows_of


def assessed():
    """Two drives: the first jumps, the second differs from it and has pitch and height."""
    first = {
        "roll": sequence(
            30, known(1.0, 0.1), known(1.5, 0.2), jumps=[(10, known(0.5, 0.05))], drift=known(0.01, 0.03)
        )
    }
    second = {
        "roll": sequence(20, known(-2.0, 0.1), drift=known(-0.25, 0.03), drifts=True, used=18, outliers=2),
        "pitch": sequence(
            20,
            known(3.0, 0.1),
            known(4.0, 0.1),
            jumps=[(5, known(1.0, 0.1))],
            drift=known(0.02, 0.05),
            values=np.repeat([3.0, 4.0], [5, 15]),
        ),
        "height": sequence(20, known(1.65, 0.01), values=np.full(20, 1.65)),
    }
    suspect = np.isin(np.arange(50), [3, 12, 13])
    ok = ~suspect & (np.arange(50) != 49)
    return rig(("a", first), ("b", second), changes={"b": (known(-3.0, 0.1), True)}, ok=ok, suspect=suspect)


DRIFTS = (
    *("drift_deg", "drift_ci95_deg", "pitch_drift_deg", "pitch_drift_ci95_deg"),
    *("height_drift_m", "height_drift_ci95_m"),
)
CHANGES = {"roll": known(0.5, 0.25), "pitch": known(0.125, 0.25), "height": UNKNOWN}


def test_json_is_every_number_of_the_assessment():
    checks = [Check("min-ok", True, "fine"), Check("max-jump", False, "far")]
    after = rig(("c", {"roll": sequence(7, known(0.0, 0.1), used=6)}))
    values = json.loads(as_json(Findings(assessed(), checks, after, CHANGES)))
    segments, against = values.pop("segments"), values.pop("against")
    assert values == {
        "frames": 50,
        "used": 48,
        "suspect": 3,
        "failed": 1,
        "outliers": 2,
        "roll_deg": -2.0,
        "roll_ci95_deg": 0.1,
        "pitch_deg": 4.0,
        "pitch_ci95_deg": 0.1,
        "height_m": 1.65,
        "height_ci95_m": 0.01,
        "between_frames_sd_deg": 0.125,
        "status": "drift",
        "drift_deg": -0.25,
        "drift_ci95_deg": 0.03,
        "pitch_drift_deg": 0.02,
        "pitch_drift_ci95_deg": 0.05,
        "height_drift_m": None,
        "height_drift_ci95_m": None,
        **{f"{name}_per_hour": None for name in DRIFTS},  # frames without stamps
        "jumps": [{"frame": 10, "file": "a/10", "change_deg": 0.5, "change_ci95_deg": 0.05}],
        "pitch_jumps": [{"frame": 35, "file": "b/5", "change_deg": 1.0, "change_ci95_deg": 0.1}],
        "height_jumps": [],
        "alignment": None,
        "checks": [
            {"name": "min-ok", "ok": True, "message": "fine"},
            {"name": "max-jump", "ok": False, "message": "far"},
        ],
    }
    named = ("drive", "first", "last", "frames", "used", "suspect", "roll_deg", "roll_ci95_deg")
    assert [[each[name] for name in named] for each in segments] == [
        ["a", 0, 9, 10, 10, 1, 1.0, 0.1],
        ["a", 10, 29, 20, 20, 2, 1.5, 0.2],
        ["b", 30, 49, 20, 20, 0, -2.0, 0.1],
    ]
    # the pitch over the frames of the roll's segment, a jump of its own aside
    assert [each["pitch_deg"] for each in segments] == [None, None, pytest.approx(3.75, abs=0.1)]
    assert [each["height_m"] for each in segments] == [None, None, pytest.approx(1.65)]
    assert against == {
        "frames": 7,
        "used": 6,
        "roll_change_deg": 0.5,
        "roll_change_ci95_deg": 0.25,
        "roll_moved": True,
        "pitch_change_deg": 0.125,
        "pitch_change_ci95_deg": 0.25,
        "pitch_moved": False,
        "height_change_m": None,
        "height_change_ci95_m": None,
        "height_moved": None,
    }


def test_csv_is_a_line_for_each_segment_with_what_came_before_it():
    first, after, second = rows_of(as_csv(Findings(assessed(), [], None, {})))
    assert (first["first_file"], first["last_file"], first["status"]) == ("a/0", "a/9", "jump")
    assert (after["first_file"], after["last_file"], second["last_file"]) == ("a/10", "a/29", "b/19")
    assert [each["change_deg"] for each in (first, after, second)] == ["", "0.5", "-3.0"]
    assert [each["change_ci95_deg"] for each in (first, after, second)] == ["", "0.05", "0.1"]
    assert [each["drift_deg"] for each in (first, after, second)] == ["0.01", "0.01", "-0.25"]
    assert [each["between_frames_sd_deg"] for each in (first, after, second)] == ["0.125"] * 3
    assert as_csv(Findings(rig(), [], None, {})) == "drive\n"


def test_the_table_is_the_answer_then_what_happened_then_the_sentences_and_checks():
    checks = [Check("min-ok", True, "fine"), Check("max-jump", False, "far")]
    assert as_table(Findings(assessed(), checks, rig(), CHANGES)).splitlines() == [
        "roll    -2.00 ± 0.10° in b, at the end, after a drift of -0.25 ± 0.03° over the drive  "
        "(48 of 50 frames, 3 suspect, 1 failed, 2 far off their neighbours)",
        "pitch   +4.00 ± 0.10° since b/5, where it jumped by +1.00 ± 0.10°",
        "height  1.65 ± 0.01 m in b",
        "drift   -0.25 ± 0.03° over b",
        "jumps   1",
        "        +0.50 ± 0.05° at a/10",
        "",
        "              roll     frames       used  from, to",
        "     +1.00 ± 0.10°         10         10  a/0, a/9",
        "     +1.50 ± 0.20°         20         20  a/10, a/29",
        "     -2.00 ± 0.10°         20         20  b/0, b/19  differs",
        "roll against the other result: +0.50 ± 0.25°, it has moved",
        "pitch against the other result: +0.12 ± 0.25°, no move is seen",
        "",
        "b differs from a by -3.00 ± 0.10°",
        "pitch jumped by +1.00 ± 0.10° at b/5",
        "ok: fine",
    ]


def test_one_drive_without_findings_is_told_in_three_lines():
    quiet = rig(("a", {"roll": sequence(9, known(1.0, 0.1), drift=known(0.0, 0.1))}))
    assert as_table(Findings(quiet, [], None, {})).splitlines() == [
        "roll    +1.00 ± 0.10°  (9 of 9 frames)",
        "drift   0.00 ± 0.10° over the drive: none is seen",
        "jumps   none",
    ]


@pytest.mark.parametrize(("drives", "more"), [(40, None), (41, 1), (1043, 1003)])
def test_of_many_segments_the_table_shows_forty(drives, more):
    many = rig(*((f"d{place}", {"roll": sequence(3, known(1.0, 0.1))}) for place in range(drives)))
    lines = as_table(Findings(many, [], None, {})).splitlines()
    assert sum(line.endswith("/2") for line in lines) == 40
    said = [line for line in lines if "more segments" in line]
    assert said == ([] if more is None else [f"and {more:,} more segments; --format csv lists all"])
