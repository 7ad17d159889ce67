"""What the paper's page and its charts show is what stands in the tables."""

import html
import math
import re

import pytest

from rollcli.evaluate import paper_page
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.evaluate.options import ExperimentOptions, PaperOptions
from rollcli.evaluate.paper_page import charts
from rollcli.evaluate.tables import SOLVER_NAMES, all_tables
from rollcli.run.options import EncodingOptions, InputOptions, RegionOptions, RunningOptions

TOLERANCES = ["0.1°", "0.01°", "0.001°", "0.0001°"]


def findings(name="a.png", gd=(3, 4, 5, 6), sweep=7):
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
        {method: tuple(error * (1 + at) for error in turned) for at, method in enumerate(METHODS)},
    )


def times(seconds):
    made = {
        (solver, form): tuple(seconds * (1 + k + 4 * at) for k in range(4))
        for at, solver in enumerate(("gss", "gd"))
        for form in FORMS
    }
    return Times(9, made)


@pytest.fixture(scope="module")
def tables():
    return all_tables([findings(), findings("b.png", (4, 4, 5, 8), 9)], [], [times(2e-3)])


def page_text(found, timed, region=None, **experiments):
    """What the page of these maps says."""
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    pytest.importorskip("jinja2", reason="jinja2, of the extra report, is not here")
    options = PaperOptions(
        InputOptions(("maps",)),
        EncodingOptions(),
        region or RegionOptions(),
        ExperimentOptions("out", **experiments),
        RunningOptions(),
    )
    page = paper_page.paper_page(all_tables(found, [], timed), found, [], timed, options).decode()
    shown = re.sub(r"<(script|style|svg).*?</\1>", "", page, flags=re.S)
    return " ".join(html.unescape(re.sub("<[^>]+>", "", shown)).split())


def test_the_page_says_what_was_done():
    seconds = {
        (solver, form): tuple(1e-3 * (400 - 10 * k if form == "textbook" else 1) for k in range(4))
        for solver in ("gss", "gd")
        for form in FORMS
    }
    text = page_text([findings()], [Times(9, seconds), Times(12_345, seconds)])
    assert "The paper's experiments on 1 map" in text
    assert "the parabola’s energy over every valid pixel, λ(0) = 26." in text
    assert "One thread, mean over 2 maps of 6,177 valid pixels." in text
    assert "at least 370 times less here" in text
    assert "Each map is rotated by −20° to 20° in steps of 2° (nearest pixel" in text
    assert "the exact minimum of the map itself plus the rotation" in text
    assert "0.001°, 0.0001°. maps.csv" in text


def test_the_page_says_what_was_asked_for():
    text = page_text(
        [findings()], [times(1)], RegionOptions(roi=(0, 0, 9, 9)), turns=(5.0, 5.0, 1.0), truth="known.csv"
    )
    assert "over every pixel of the chosen region" in text
    assert "Each map is rotated by 5° (nearest pixel" in text
    assert "the known angle in known.csv plus the rotation" in text


@pytest.mark.parametrize(("count", "words"), [(50, "maps.csv"), (52, "2 more in maps.csv")])
def test_the_page_lists_fifty_maps_and_counts_the_others(count, words):
    text = page_text([findings(f"map{k}.png") for k in range(count)], [times(1)])
    assert f"experiments on {count} maps" in text
    assert f"0.001°, 0.0001°. {words}" in text
    assert [text.count(f"map{k}.png") for k in (0, 49, 50, 51)] == [1, 1, 0, 0]


@pytest.mark.parametrize(
    ("turns", "angles"),
    [
        (ExperimentOptions("out").turns, range(-20, 21, 2)),
        ((0.0, 0.3, 0.1), (0, 0.1, 0.2, 0.3)),  # the last is reached, whatever is rounded
        ((1.0, 2.95, 1.0), (1, 2)),
        ((-8.0, -8.0, 3.0), (-8,)),
    ],
)
def test_maps_are_turned_from_the_first_angle_in_steps_to_the_last(turns, angles):
    assert ExperimentOptions("out", turns).turns_deg == pytest.approx(tuple(angles))


def traces(chart):
    return {trace["name"]: trace for trace in chart.data}


def test_iterations_of_both_solvers_stand_beside_the_papers(tables):
    drawn = traces(charts(tables)["iterations"])
    assert list(drawn) == [
        "golden section",
        "golden section, paper",
        "gradient descent",
        "gradient descent, paper",
    ]
    assert all(trace["x"] == TOLERANCES for trace in drawn.values())
    assert drawn["gradient descent"]["y"] == [3.5, 4, 5, 7]
    assert drawn["gradient descent, paper"]["y"] == [3, 4, 4, 4]
    assert drawn["golden section"]["y"] == drawn["golden section, paper"]["y"] == [16, 21, 26, 30]


def test_mean_errors_of_the_solvers_are_drawn_in_degrees(tables):
    drawn = traces(charts(tables)["accuracy"])
    assert set(drawn) == set(SOLVER_NAMES.values())
    for at, solver in enumerate(SOLVERS):
        mean = [math.degrees(0.002 * (1 + at) / (1 + k)) for k in range(4)]
        assert drawn[SOLVER_NAMES[solver]]["y"] == pytest.approx(mean)
        assert drawn[SOLVER_NAMES[solver]]["x"] == TOLERANCES
        is_open = drawn[SOLVER_NAMES[solver]]["marker"].get("symbol") == "circle-open"
        assert is_open == (solver == "exact")  # it lies around the others
    axis = charts(tables)["accuracy"].layout["yaxis"]
    assert (axis["type"], axis["dtick"], axis["ticksuffix"]) == ("log", 1, "°")  # a label at each decade


def test_run_times_and_errors_lie_where_the_axes_say(tables):
    table = tables["table2_runtime"]
    forms = {"paper (Matlab)": "paper_s", "n × 3 form": "textbook_s", "moments": "moments_s"}
    runtime = charts(tables)["runtime"]
    for name, column in forms.items():
        drawn = [trace for trace in runtime.data if trace["name"] == name]
        assert [trace["showlegend"] for trace in drawn] == [True, False]
        for trace, solver in zip(drawn, ("gss", "gd"), strict=True):
            assert trace["x"] == [[SOLVER_NAMES[solver]] * 4, TOLERANCES]
            assert trace["y"] == table.where(solver=solver).column(column)
    axis = runtime.layout["yaxis"]
    unit = {"µs": 1e-6, "ms": 1e-3, "s": 1.0}
    named = [float(text.split()[0]) * unit[text.split()[1]] for text in axis["ticktext"]]
    assert axis["tickvals"] == pytest.approx(named)
    drawn, table = traces(charts(tables)["methods"]), tables["methods_accuracy"]
    for name, column in (("median", "median_deg"), ("95th percentile", "p95_deg"), ("worst", "worst_deg")):
        assert (drawn[name]["x"], len(drawn[name]["y"])) == (table.column(column), len(METHODS))


@pytest.mark.parametrize(("first", "shown"), [(2e-6, "2 µs4 µs6 µs8 µs"), (0.5, "500 ms1 s1.5 s2 s")])
def test_run_times_are_in_the_unit_that_suits(first, shown):
    assert shown in page_text([findings()], [times(first)])


def test_learning_rates_are_all_in_view_and_a_line_from_end_to_end_marks_the_papers(tables):
    chart = charts(tables)["lambda0"]
    low, high = chart.layout["xaxis"]["range"]
    assert low == 0
    assert max(LAMBDAS) < high <= max(LAMBDAS) + 1
    (line,), (text,) = chart.layout["shapes"], chart.layout["annotations"]
    assert [line[end] for end in ("x0", "x1", "y0", "y1", "yref")] == [26, 26, 0, 1, "paper"]
    assert (text["x"], text["y"], text["text"], text["showarrow"]) == (26, 0, "26", False)
    assert len({trace["line"]["color"] for trace in chart.data}) == len(DELTAS)
    for delta, trace in enumerate(chart.data):
        assert trace["x"] == list(LAMBDAS)
        assert trace["y"] == [8 + delta + (rate > 26) for rate in LAMBDAS]
