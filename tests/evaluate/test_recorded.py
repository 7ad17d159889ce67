"""What the experiments and comparisons with known angles give, to the digit; see `tests.recorded`."""

import dataclasses
import html
import json
import math
import re
import tempfile
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from rollcli import __version__
from rollcli.evaluate.accuracy import as_csv, as_json, as_table, assess
from rollcli.evaluate.experiments import (
    DELTAS,
    FORMS,
    LAMBDAS,
    SOLVERS,
    Findings,
    Textbook,
    Times,
    examine,
    rotate_nearest,
)
from rollcli.evaluate.options import PaperOptions
from rollcli.evaluate.paper import PAGE, paper_files
from rollcli.evaluate.paper_tables import METHOD_NAMES, all_tables, table_csv
from rollcli.evaluate.truth import KnownPose, read_truth
from rollcli.files.results import Row
from rollcli.run.options import InputOptions, RegionOptions
from tests.estimator.synthetic_maps import bent_road
from tests.recorded import made, recorded_test
from tests.report.test_recorded import drawn

ANGLES = ((-1.0, 1.0, 0.3), (0.0, 5.0, 2.0), (0.0, 0.3, 0.1), (1.0, 2.95, 1.0), (-8.0, -8.0, 3.0))
TURNS = [math.radians(turn) for turn in (-38, -3.5, 12)]


@cache
def _found():
    curved = bent_road(4, width=72, height=54, bend=0.003, noise=0.4, seed=1)
    holed = bent_road(-7, width=66, height=60, noise=0.2, seed=2)
    holed[20:30, :40] = 0
    return (
        examine("curved.png", curved, TURNS, None, chosen=False),
        examine("holed.png", holed, TURNS[1:], math.radians(-7.1), chosen=True),
    )


def _tables():
    seconds = {
        (solver, form): tuple(1e-4 * (1 + k) * (1 + at) * (1 + more) for k in range(4))
        for at, solver in enumerate(("gss", "gd"))
        for more, form in enumerate(FORMS)
    }
    return all_tables(
        _found(), [Row("bad.png", message="no pixel")], [Times(900, seconds), Times(700, seconds)]
    )


def _textbook():
    textbook = Textbook(bent_road(5, width=40, height=30, noise=0.3, seed=4))
    return [
        [textbook.golden_section(delta), textbook.gradient_descent(delta)] for delta in (1e-2, 1e-4, 1e-6)
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
    found = assess([*rows[:20], Row("maps/other.png", status="ok", roll_deg=1.0)], truth, "rolls.csv")
    return found if form is None else form(found)


def _map_of(name="a.png", gd=(3, 4, 5, 6), sweep=7):
    """A map whose numbers are all different."""
    turned = [0.001 * (1 + k) for k in range(3)]
    return Findings(
        name,
        40,
        20,
        600,
        -math.radians(2.5),
        (16, 21, 26, 30),
        gd,
        tuple(tuple(sweep + delta + (rate > 26) for rate in LAMBDAS) for delta in range(len(DELTAS))),
        {
            solver: tuple(tuple(error * (1 + at) / (1 + k) for k in range(4)) for error in turned)
            for at, solver in enumerate(SOLVERS)
        },
        {method: tuple(error * (1 + at) for error in turned) for at, method in enumerate(METHOD_NAMES)},
    )


def _times(seconds):
    of_each = {
        (solver, form): tuple(
            seconds * (1 + k + 4 * at) * (1 + (399 + k) * (form == "textbook")) for k in range(4)
        )
        for at, solver in enumerate(("gss", "gd"))
        for form in FORMS
    }
    return Times(9, of_each)


def _figures(tables):
    module = pytest.importorskip("rollcli.evaluate.paper_figures", reason="matplotlib is not here")
    return module.paper_figures(tables)


_asked = partial(PaperOptions, inputs=InputOptions(("maps",)), output="out")


def _page(count=1, seconds=(1.0,), region=None, **experiments):
    """What the page of these maps says."""
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    pytest.importorskip("jinja2", reason="jinja2, of the extra report, is not here")
    found, timed = [_map_of(f"map{place}.png") for place in range(count)], [_times(each) for each in seconds]
    page = paper_files(found, [], timed, _asked(region=region or RegionOptions(), **experiments))[
        PAGE
    ].decode()
    page = page.replace(f"rollcli {__version__}", "rollcli")
    shown = re.sub(r"<(script|style|svg).*?</\1>", "", page, flags=re.S)
    return " ".join(html.unescape(re.sub("<[^>]+>", "", shown)).split())


def _tables_without_angles():
    """The tables, as CSV, of a map of which no method gives an angle, and half of the runs stop short."""
    found = _map_of()
    stopped = tuple(tuple(count if k % 2 else None for k, count in enumerate(each)) for each in found.sweep)
    errors = dict.fromkeys(METHOD_NAMES, (None,) * 3)
    found = dataclasses.replace(found, sweep=stopped, method_errors=errors)
    return {name: table_csv(table).decode() for name, table in all_tables([found], [], [_times(0.1)]).items()}


TRUTHS = Path(__file__).with_name("truths.txt").read_text("utf-8").partition("\n\n")[2].splitlines()


def _known():
    """What files of known angles hold, and why some are refused."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "truth.csv")
        found = [made(read_truth, path)]
        for text in ("", *TRUTHS):
            path.write_bytes(text.encode().decode("unicode_escape").encode())
            found.append(made(read_truth, path))
    return json.loads(json.dumps(found, default=str).replace(folder, "."))


def _unlike(form):
    """Results without an angle, without intervals, of other frames, or of one frame twice."""
    known = {"a": KnownPose(0.01)}
    error, whole = Row("maps/a.png", status="error"), Row("maps/a.png", status="ok", roll_deg=1 / 3)
    given = [[error], [whole], [whole, error], [Row("maps/b.png", status="ok", roll_deg=1.0)]]
    found = [made(assess, rows, known, "r.csv") for rows in given]
    return [each if isinstance(each, str) else form(each) for each in found]


CASES = {
    "findings": _found,
    "tables": lambda: {name: [list(row.values()) for row in table] for name, table in _tables().items()},
    "figures": lambda: {name: drawn(each) for name, each in _figures(_tables()).items()},
    "textbook": _textbook,
    "turned": lambda: [
        rotate_nearest(np.arange(1.0, 71).reshape(7, 10), turn) for turn in (*TURNS, 0.0, math.pi / 2)
    ],
    "angles": lambda: [_asked(turns=turns).turns_deg for turns in ANGLES],
    "tables without angles": _tables_without_angles,
    "page": _page,
    "page of two": partial(_page, 2, (2e-6, 3e-6)),
    "page of fifty": partial(_page, 50),
    "page of more, with what was asked": partial(
        _page, 52, (0.5,), RegionOptions(roi=(0, 0, 9, 9)), turns=(5.0, 5.0, 1.0), truth="known.csv"
    ),
    "known": _known,
    **{f"unlike {form.__name__}": partial(_unlike, form) for form in (as_table, as_csv, as_json)},
    "compared": partial(_compared, None),
    "as a table": partial(_compared, as_table),
    "as csv": partial(_compared, as_csv),
    "as json": partial(_compared, as_json),
}

test_answers_are_those_recorded = recorded_test("evaluate", CASES, rel=2e-4, least=2e-4)
