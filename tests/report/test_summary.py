"""What a report says in words and numbers, by hand."""

import html
import json
import os
from dataclasses import replace

import pytest

from rollcli.report import content
from rollcli.report.chart import Chart, chart_names, script_json
from rollcli.report.sources import SPREAD, SUSPECT, WIDEST, Choice
from rollcli.report.summary import summarize, written_at
from tests.report.results import row


def test_the_middle_is_from_the_5th_to_the_95th_percentile():
    found = summarize([row(f"{i}.png", float(i), None) for i in range(101)])
    assert (found.middle, found.extremes) == ((5, 95), (0, 100))
    assert found.half_width is None
    nothing = summarize([row("a.png", None)])
    assert (nothing.middle, nothing.extremes, nothing.frames) == (None, None, 1)


def test_the_time_of_a_file_is_told_in_utc_and_that_of_a_stream_is_not(tmp_path):
    (tmp_path / "rolls.csv").touch()
    os.utime(tmp_path / "rolls.csv", (86_400 * 365 + 3_720, 86_400 * 365 + 3_720))
    assert written_at(str(tmp_path / "rolls.csv")) == "1971-01-01 01:02 UTC"
    assert written_at("-") == written_at("s3://maps/rolls.csv") == written_at("a\0b") == ""


def test_a_histogram_is_of_two_angles_or_more():
    assert chart_names([row("a.png"), row("b.png")]) == ["roll", "histogram"]
    assert chart_names([row("a.png"), row("b.png", None)]) == ["roll"]
    posed = replace(row("a.png", None), pitch_deg=0.0, height_m=1.5)
    assert chart_names([row("b.png", None), posed]) == ["roll", "pitch", "height"]
    pairs = [replace(row(f"{name}.png", None), right_lower_px=0.1) for name in "ab"]
    assert chart_names(pairs) == ["roll", "alignment"]
    assert chart_names(pairs[:1]) == ["roll"]


@pytest.mark.parametrize(
    ("chosen", "angled", "words"),
    [
        ([], 5, "Every frame that has an angle."),
        ([SPREAD] * 5, 5, "Every frame that has an angle."),
        ([SPREAD] * 2, 5, "2 of 5 frames that have an angle: 2 evenly spread."),
        (
            [SUSPECT, SPREAD],
            5,
            "2 of 5 frames that have an angle: 1 of the suspect ones and 1 evenly spread over the rest.",
        ),
        (
            [WIDEST, WIDEST, SUSPECT, SPREAD],
            1000,
            "4 of 1,000 frames that have an angle: the 2 with the widest interval, 1 of the other suspect "
            "ones and 1 evenly spread over the rest.",
        ),
        ([WIDEST], 2, "1 of 2 frames that have an angle: the 1 with the widest interval."),
    ],
)
def test_which_frames_are_shown_is_said_in_words(chosen, angled, words):
    rows = [row(f"{i}.png", 1.0 if i < angled else None) for i in range(angled + 3)]
    assert content._chosen_text(rows, [Choice(place, reason) for place, reason in enumerate(chosen)]) == words


def test_json_in_a_script_cannot_end_it():
    value = {"a": "</script><!--&\u2028\u2029"}
    text = script_json(value)
    assert not set(text) & set("<>&\u2028\u2029")
    assert json.loads(text) == value
    with pytest.raises(ValueError, match="not JSON compliant"):
        script_json([float("nan")])
    page = Chart('"a"', "<b>", [], still="<svg/>").__html__()
    assert page.startswith(
        '<div class="chart" id="&quot;a&quot;" role="img" aria-label="&lt;b&gt;"><svg/></div>'
    )
    assert html.unescape(page).endswith('data-chart=""a"">{"data": [], "layout": {}}</script>')
