"""What the paper's page and its charts show is what stands in the tables."""

import html
import math
import re

import pytest

from rollcli.evaluate import paper_page
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.evaluate.options import ExperimentOptions, PaperOptions
from rollcli.evaluate.tables import all_tables
from rollcli.run.options import EncodingOptions, InputOptions, RegionOptions, RunningOptions


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


@pytest.mark.parametrize(("first", "shown"), [(2e-6, "2 µs4 µs6 µs8 µs"), (0.5, "500 ms1 s1.5 s2 s")])
def test_run_times_are_in_the_unit_that_suits(first, shown):
    assert shown in page_text([findings()], [times(first)])
