"""What the charts and the summary hold."""

import html
import json
import os
from dataclasses import replace

import pytest

from rollcli.report.charts import chart_over_frames, view
from rollcli.report.options import chart_names
from rollcli.report.page import Chart, script_json
from rollcli.report.summary import degrees, with_interval, written_at
from rollcli.rig.quantities import HEIGHT, ROLL
from tests.report.results import row


def traces_of(chart):
    return {trace["name"]: trace for trace in chart.data}


def traces(rows):
    return traces_of(chart_over_frames(rows))


@pytest.mark.parametrize(
    ("half", "words"),
    [(None, "+2.35°"), (0.5, "+2.35° ± 0.50°"), (0.012, "+2.35° ± 0.01°"), (0.0042, "+2.346° ± 0.004°")],
)
def test_an_angle_has_as_many_decimals_as_its_interval_is_worth(half, words):
    assert with_interval(2.3456, half) == words


@pytest.mark.parametrize(("quantity", "unit"), [(ROLL, 1.0), (HEIGHT, 0.1)])
def test_suspect_values_and_intervals_widen_the_view_up_to_a_limit(quantity, unit):
    def ends(*further):
        rows = []
        for value, half, status in ((0.0, None, "ok"), (10.0, 0.0, "ok"), *further):
            now = {quantity.column: value * unit, quantity.ci_column: None if half is None else half * unit}
            rows.append(replace(row("a.png", None), status=status, **now))
        return [end / unit for end in view(rows, quantity)]

    def seen(low, high):  # a 16th of the range and a 20th of a degree are left beyond it
        return pytest.approx([low - 0.06 * (high - low) - 0.05, high + 0.06 * (high - low) + 0.05], abs=0.006)

    assert ends((5.0, 9.0, "suspect")) == seen(0, 10)
    assert ends((-3.99, None, "suspect"), (13.99, None, "suspect")) == seen(-3.99, 13.99)
    assert ends((-4.01, None, "suspect"), (14.01, None, "suspect")) == seen(0, 10)
    assert ends((9.5, 0.9, "ok"), (0.5, 0.9, "ok")) == seen(-0.4, 10.4)
    assert ends((9.5, 7.0, "ok"), (0.5, 7.0, "ok")) == seen(-0.5, 10.5)
    assert view([row("a.png", None)], quantity) == (-unit, unit)


@pytest.mark.parametrize(("frames", "bars"), [(400, True), (402, False)])
def test_suspect_marks_lie_below_the_line_and_have_no_bars_in_long_runs(frames, bars):
    shown = traces([row("a.png"), row("b.png", 9.0, 1.0, "suspect")] * (frames // 2))
    assert list(shown) == ["95 % interval", "suspect", "roll", *([] if bars else ["roll, alone"])]
    assert ("error_y" in shown["suspect"]) == bars


@pytest.mark.parametrize(
    ("angle", "text"), [(1.234, "+1.23°"), (-1.235, "−1.24°"), (-0.001, "0.00°"), (0.0, "0.00°"), (None, "–")]
)
def test_angles_are_printed_with_a_sign_unless_they_are_nothing(angle, text):
    assert degrees(angle) == text


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
