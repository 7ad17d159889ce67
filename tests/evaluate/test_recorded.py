"""What the experiments and comparisons with known angles give, to the digit; see `tests.recorded`."""

import dataclasses
import math
from functools import cache, partial

import numpy as np
import pytest

from rollcli.evaluate.accuracy import assess
from rollcli.evaluate.experiments import FORMS, Textbook, Times, examine, rotate_nearest
from rollcli.evaluate.options import ExperimentOptions
from rollcli.evaluate.paper_page import charts
from rollcli.evaluate.run_accuracy import as_csv, as_json, as_table
from rollcli.evaluate.tables import all_tables
from rollcli.evaluate.truth import KnownPose
from rollcli.files.results import Row
from tests.estimator.synthetic_maps import bent_road
from tests.recorded import check

TURNS = [math.radians(turn) for turn in (-20, -3.5, 12)]


@cache
def _found():
    curved = bent_road(4, width=72, height=54, bend=0.003, noise=0.4, seed=1)
    holed = bent_road(-7, width=66, height=60, noise=0.2, seed=2)
    holed[20:30, :40] = 0
    return (
        examine("curved.png", curved, TURNS),
        examine("holed.png", holed, TURNS[1:], math.radians(-7.1), chosen=True),
    )


def _tables():
    seconds = {
        (solver, form): tuple(1e-4 * (1 + k) * (1 + at) * (1 + more) for k in range(4))
        for at, solver in enumerate(("gss", "gd"))
        for more, form in enumerate(FORMS)
    }
    return all_tables(_found(), [("bad.png", "no pixel")], [Times(900, seconds), Times(700, seconds)])


def _textbook():
    textbook = Textbook.of(bent_road(5, width=40, height=30, noise=0.3, seed=4))
    return [
        [textbook.golden_section(delta), textbook.gradient_descent(delta, lambda0=26.0)]
        for delta in (1e-2, 1e-4, 1e-6)
    ]


def _compared(form):
    rng = np.random.default_rng(6)
    truth = {
        f"f{k}": KnownPose(
            float(rng.uniform(-0.3, 0.3)),
            None if k % 4 == 3 else float(rng.uniform(0, 6)),
            None if k % 5 == 4 else float(rng.uniform(1, 2)),
        )
        for k in range(24)
    }
    rows = [
        Row(
            f"maps/{stem}.png",
            status="suspect" if k % 6 == 5 else "ok",
            roll_deg=math.degrees(pose.theta) + rng.normal(0, 0.4) + (180 if k == 7 else 0),
            roll_ci95_deg=None if k % 7 == 6 else 0.6,
            pitch_deg=None if k % 3 == 2 else (pose.pitch_deg or 0) + rng.normal(0, 0.3),
            pitch_ci95_deg=0.4,
            height_m=(pose.height_m or 1) + rng.normal(0, 0.02),
            height_ci95_m=0.03,
        )
        for k, (stem, pose) in enumerate(truth.items())
    ]
    rows[3] = Row("maps/f3.png", status="error")
    found = assess([*rows[:20], Row("maps/other.png", status="ok", roll_deg=1.0)], truth)
    return found if form is None else form(found)


CASES = {
    "findings": _found,
    "tables": lambda: {name: table.rows for name, table in _tables().items()},
    "charts": lambda: {name: dataclasses.asdict(chart) for name, chart in charts(_tables()).items()},
    "textbook": _textbook,
    "turned": lambda: [rotate_nearest(np.arange(1.0, 71).reshape(7, 10), turn) for turn in TURNS],
    "angles": lambda: [
        ExperimentOptions("out", turns).turns_deg for turns in ((-1.0, 1.0, 0.3), (0.0, 5.0, 2.0))
    ],
    "compared": partial(_compared, None),
    "as a table": partial(_compared, as_table),
    "as csv": partial(_compared, as_csv),
    "as json": partial(_compared, as_json),
}


@pytest.mark.parametrize("case", CASES)
def test_answers_are_those_recorded(case):
    check("evaluate", case, CASES[case](), rel=2e-4, least=2e-4)
