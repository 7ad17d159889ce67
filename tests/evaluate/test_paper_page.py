"""What the paper's page and its charts show is what stands in the tables."""

import html
import math
import re
from dataclasses import replace

import pytest

from rollcli.evaluate import paper_page
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.evaluate.options import ExperimentOptions, PaperOptions
from rollcli.evaluate.paper_page import charts
from rollcli.evaluate.tables import DELTAS_DEG, METHOD_NAMES, SOLVER_NAMES, all_tables
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


def test_run_times_are_drawn_for_each_form_and_solver_on_decades(tables):
    chart = charts(tables)["runtime"]
    table = tables["table2_runtime"]
    columns = ("paper_s", "textbook_s", "with_pass_s", "moments_s")
    expected = [table.where(solver=solver).column(name) for name in columns for solver in ("gss", "gd")]
    assert [trace["y"] for trace in chart.data] == expected
    assert [trace["showlegend"] for trace in chart.data] == [True, False] * 4
    assert [trace["x"][0][0] for trace in chart.data] == ["golden section", "gradient descent"] * 4
    axis = chart.layout["yaxis"]
    assert dict(zip(axis["ticktext"], axis["tickvals"], strict=True)) == pytest.approx(
        {"10 µs": 1e-5, "100 µs": 1e-4, "1 ms": 1e-3, "10 ms": 0.01, "100 ms": 0.1, "1 s": 1, "10 s": 10}
    )


def test_the_sweep_is_drawn_over_every_first_rate_with_the_papers_marked(tables):
    chart = charts(tables)["lambda0"]
    assert len(chart.data) == 4
    for place, trace in enumerate(chart.data):
        assert trace["x"] == list(range(1, 101))
        assert trace["y"] == [8 + place + (rate > 26) for rate in LAMBDAS]
    assert [trace["line"]["color"] for trace in chart.data] == ["@c1", "@c2", "@c3", "@c4"]
    assert chart.layout["xaxis"]["range"] == [0, 101]  # one more than the rates on each side
    (mark,) = chart.layout["shapes"]
    assert (mark["x0"], mark["x1"], mark["y0"], mark["y1"]) == (26, 26, 0, 1)
    assert mark["line"]["width"] < min(trace["line"]["width"] for trace in chart.data)
    (text,) = chart.layout["annotations"]
    assert (text["x"], text["y"], text["text"], text["showarrow"]) == (26, 0, "26", False)


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


def test_median_and_worst_of_each_method_are_drawn_in_degrees(tables):
    drawn = traces(charts(tables)["methods"])
    assert list(drawn) == ["median", "95th percentile", "worst"]
    for name, radians in (("median", 0.002), ("worst", 0.003)):
        assert drawn[name]["y"] == [METHOD_NAMES[method] for method in METHODS]
        assert drawn[name]["x"] == pytest.approx([math.degrees(radians * (1 + k)) for k in range(5)])


def test_the_pages_iterations_have_a_span_where_the_maps_differ(tables):
    gss, gd = paper_page._iterations(tables["table1_iterations"])
    assert gss == ("golden section", ["16", "21", "26", "30"], ["16", "21", "26", "30"])
    assert gd == ("gradient descent", ["3", "4", "4", "4"], ["3.50 (3–4)", "4", "5", "7.00 (6–8)"])


def test_the_pages_run_times_are_in_the_unit_that_suits(tables):
    lines = paper_page._runtimes(tables["table2_runtime"])
    assert [solver for solver, _, _ in lines] == ["golden section"] * 4 + ["gradient descent"] * 4
    assert lines[0][2] == ["1.55 s", "1.99 s", "2.46 s", "2.81 s"]
    assert lines[3][2] == ["2 ms", "4 ms", "6 ms", "8 ms"]
    assert lines[7][2] == ["10 ms", "12 ms", "14 ms", "16 ms"]
    said = [paper_page._duration(seconds) for seconds in (12.3456, 1.0, 0.99951, 1e-3, 9.9951e-4, 5e-7)]
    assert said == ["12.3 s", "1 s", "1e+03 ms", "1 ms", "1e+03 µs", "0.5 µs"]


def test_the_pages_methods_have_a_dash_where_there_is_no_figure(tables):
    lines = paper_page._methods(tables["methods_accuracy"])
    assert [line[0] for line in lines] == list(METHOD_NAMES.values())
    assert lines[0][1] == f"{math.degrees(0.002):.5f}°"
    assert lines[0][-1] == "0"
    missing = replace(findings(), method_errors=dict.fromkeys(METHODS, (None,) * 3))
    none = paper_page._methods(all_tables([missing], [], [times(1)])["methods_accuracy"])
    assert none[0][1:] == ("–",) * 4 + ("3",)


def test_the_page_names_the_rates_with_the_fewest_iterations_on_every_map(tables):
    lines = paper_page._lowest(tables["fig3_lambda0"])
    assert lines == [
        (f"{delta:g}°", f"{8 + place:.2f} at λ(0) = 1–26", f"{8 + place:.2f}")
        for place, delta in enumerate(DELTAS_DEG)
    ]
    short = replace(findings(), sweep=tuple((None, *counts[1:]) for counts in findings().sweep))
    left = paper_page._lowest(all_tables([short], [], [times(1)])["fig3_lambda0"])
    assert left[0][1] == "7.00 at λ(0) = 2–26"
    nowhere = replace(findings(), sweep=((None,) * 100,) * 4)
    assert paper_page._lowest(all_tables([nowhere], [], [times(1)])["fig3_lambda0"])[0][1:] == ("–", "–")


@pytest.mark.parametrize(
    ("rates", "words"), [([], ""), ([5.0], "5"), ([1, 2, 3], "1–3"), ([8, 9, 26, 30, 31], "8–9, 26, 30–31")]
)
def test_runs_of_rates_are_told_by_their_ends(rates, words):
    assert paper_page._spans(rates) == words


def test_a_map_is_told_by_its_size_share_and_angle():
    assert paper_page._map(findings()) == {
        "file": "a.png",
        "size": "40×20",
        "valid": "75 %",
        "theta": "−2.5000°",
        "gss": "16 21 26 30",
        "gd": "3 4 5 6",
    }
