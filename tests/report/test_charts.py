"""What the charts and the summary hold."""

import html
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from rollcli.report.charts import all_charts, chart_over_frames, histogram, outside, view
from rollcli.report.options import chart_names
from rollcli.report.page import Chart, script_json
from rollcli.report.summary import common_run, degrees, summarize, with_interval, written_at
from rollcli.rig.drive.assess import assess_rig
from rollcli.rig.quantities import HEIGHT, ROLL
from tests.report.results import row

ROWS = [
    row("a.png", 1.0, 0.1),
    row("b.png", 2.0, 0.2),
    row("c.png", 1.5, 0.9, "suspect"),
    row("d.png", None),
    row("e.png", -1.0, 0.1),
    row("f.png", 0.5, None),
    row("<b>g</b>&amp;.png", 0.0, 0.3),
]


def traces_of(chart):
    return {trace["name"]: trace for trace in chart.data}


def traces(rows):
    return traces_of(chart_over_frames(rows))


def test_the_line_breaks_where_frames_have_failed_and_leaves_suspect_ones_to_their_marks():
    shown = traces(ROWS)
    assert shown["roll"]["x"] == [1, 2, None, 5, 6, 7, None]
    assert shown["roll"]["y"] == [1.0, 2.0, None, -1.0, 0.5, 0.0, None]
    assert (shown["suspect"]["x"], shown["suspect"]["error_y"]["array"]) == ([3], [0.9])
    assert (shown["failed"]["x"], shown["failed"]["yaxis"]) == ([4], "y2")


def test_the_band_is_the_interval_and_breaks_where_there_is_none():
    band = traces(ROWS)["95 % interval"]
    assert band["x"] == [1, 2, 2, 1, None, 5, 5, None, 7, 7, None]
    assert band["y"] == [1.1, 2.2, 1.8, 0.9, None, -0.9, -1.1, None, 0.3, -0.3, None]


def test_hover_labels_show_names_as_they_are():
    labels = traces(ROWS)["roll"]["customdata"]
    assert labels[0] == "a.png<br>+1.00° ± 0.10°"
    assert labels[-2].startswith("&lt;b&gt;g&lt;/b&gt;&amp;amp;.png<br>0.00°")
    long = traces([row("folder/" * 20 + "frame.png")])["roll"]["customdata"][0].partition("<br>")[0]
    assert len(long) == 44
    assert long.endswith("folder/frame.png")


def test_hover_labels_say_why_a_frame_is_suspect_or_has_failed_in_lines_that_fit():
    reason = "the interval is wide: ± 3.10 degrees; <b>few</b> pixels; " * 9
    doubtful = [row("a.png", 1.0, 0.004, "suspect", reason), row("b.png", None, message="b.png: is empty")]
    suspect = traces(doubtful)["suspect"]["customdata"][0].split("<br>")
    assert suspect[:3] == ["a.png", "+1.000° ± 0.004°", "suspect"]
    assert suspect[3] == "the interval is wide: ± 3.10 degrees;"
    assert "&lt;b&gt;few&lt;/b&gt;" in " ".join(suspect)
    assert max(len(html.unescape(line)) for line in suspect) <= 44
    assert len(suspect) == 8
    assert traces(doubtful)["failed"]["customdata"] == ["b.png<br>failed<br>b.png: is empty"]


@pytest.mark.parametrize(
    ("half", "words"),
    [(None, "+2.35°"), (0.5, "+2.35° ± 0.50°"), (0.012, "+2.35° ± 0.01°"), (0.0042, "+2.346° ± 0.004°")],
)
def test_an_angle_has_as_many_decimals_as_its_interval_is_worth(half, words):
    assert with_interval(2.3456, half) == words


@pytest.mark.parametrize("count", [1, 2, 18, 40])
def test_few_frames_have_few_bars_and_single_ones_are_no_walls(count):
    chart = histogram([row(f"{i}.png", 3 + i / 100) for i in range(count)])
    (bars,) = chart.data
    low, high = chart.layout["xaxis"]["range"]
    assert sum(bars["y"]) == count
    assert len(bars["y"]) <= 2 * np.sqrt(count) + 4
    assert bars["width"] >= 0.01
    assert bars["width"] < (high - low) / 4


def test_an_angle_far_off_does_not_flatten_the_others():
    rows = [row(f"{i}.png", 1 + i / 100) for i in range(100)] + [row("off.png", -80.0, 0.1, "suspect")]
    low, high = view(rows)
    assert 0.5 < low < 1 < 2 < high < 2.5
    assert outside(rows) == 1
    assert outside(rows[:-1]) == 0


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
    ("rows", "named"),
    [
        ([row("a.png", None)], ["failed"]),
        ([row("a.png", 3.0, None, "suspect")], ["suspect"]),
        ([row("a.png", 3.0, 0.1)], ["95 % interval", "roll"]),
    ],
)
def test_the_legend_names_what_is_there_even_if_it_is_one_thing(rows, named):
    chart = chart_over_frames(rows)
    assert chart.layout["showlegend"]
    assert [trace["name"] for trace in chart.data] == named
    assert chart.layout["xaxis"]["dtick"] == 1
    assert "dtick" not in chart_over_frames(rows * 100).layout["xaxis"]


@pytest.mark.parametrize(
    ("angle", "text"), [(1.234, "+1.23°"), (-1.235, "−1.24°"), (-0.001, "0.00°"), (0.0, "0.00°"), (None, "–")]
)
def test_angles_are_printed_with_a_sign_unless_they_are_nothing(angle, text):
    assert degrees(angle) == text


def drive_rows(folder, level, frames=400, jump=0.0):
    rng = np.random.default_rng(3)
    rolls = level + rng.normal(0, 0.05, frames)
    rolls[frames // 2 :] += jump
    return [row(f"{folder}/{place}.png", float(roll), 0.05) for place, roll in enumerate(rolls)]


def test_the_chart_shows_segments_and_jumps():
    rows = drive_rows("run", 0.2, jump=0.8)
    shown = {trace["name"]: trace for trace in chart_over_frames(rows, rig=assess_rig(rows)).data}
    assert shown["jump"]["x"] == [200.5, 200.5, None]
    assert shown["jump"]["text"][0].startswith("jump by +0.")
    assert shown["jump"]["text"][0].endswith(" at run/200.png")
    assert shown["mounting"]["x"] == [1, 200, None, 201, 400, None]
    assert shown["mounting"]["y"][0] == pytest.approx(0.2, abs=0.03)
    assert shown["mounting"]["y"][3] == pytest.approx(1.0, abs=0.03)
    assert shown["mounting, 95 %"]["x"] == [1, 200, 200, 1, None, 201, 400, 400, 201, None]
    (drive,) = assess_rig(rows).drives
    for place, segment in enumerate(drive.quantities["roll"].segments):
        mean, half = segment.mean.value, segment.mean.ci95
        high, _, _, low = shown["mounting, 95 %"]["y"][5 * place : 5 * place + 4]
        assert (high, low) == pytest.approx((mean + half, mean - half), abs=1e-4)


def test_a_rig_that_lies_level_is_drawn_at_nothing():
    rows = [row(f"{place}.png", 0.0, 0.05) for place in range(30)]
    shown = {trace["name"]: trace for trace in chart_over_frames(rows, rig=assess_rig(rows)).data}
    assert shown["mounting"]["y"] == [0, 0, None]
    top, _, _, bottom, _ = shown["mounting, 95 %"]["y"]
    assert top == -bottom > 0


def test_the_page_has_no_more_than_four_decimals():
    rows = [posed(each.file, 3.0 + k / 7, 0.05, 1.5) for k, each in enumerate(drive_rows("run", 0.2, 30))]
    for chart in all_charts(rows, assess_rig(rows)).values():
        for each in (value for trace in chart.data for value in trace["y"] if isinstance(value, float)):
            assert round(each, 4) == each or each in [r.pitch_deg for r in rows]


def test_records_of_several_runs_tell_what_all_of_them_have():
    one = {"version": "1", "options": {"road": "auto", "jobs": 2}, "encoding": ["kitti"], "hours": 1}
    other = {"version": "1", "options": {"road": "auto", "jobs": 3}, "encoding": ["kitti", "npy"], "hours": 2}
    both = {"version": "1", "options": {"road": "auto"}, "encoding": ["kitti", "npy"]}
    assert common_run([one, other]) == both
    assert common_run([one]) == one
    assert common_run([None]) is common_run([one, None]) is common_run([None, one]) is None


def test_a_long_run_has_a_line_without_dots_and_a_dot_for_each_frame_that_stands_alone():
    rows = [row(f"{place}.png") for place in range(500)]
    for place in (20, 22, 24):
        rows[place] = row(f"{place}.png", 9.0, 1.0, "suspect")
    shown = traces(rows)
    assert shown["roll"]["mode"] == "lines"
    assert shown["roll, alone"]["x"] == [22, 24]
    assert traces(rows[:400])["roll"]["mode"] == "lines+markers"


def test_no_line_leads_from_one_drive_to_another():
    rows = [*drive_rows("monday", 0.2, 30), *drive_rows("tuesday", 0.2, 30)]
    shown = {trace["name"]: trace for trace in chart_over_frames(rows, rig=assess_rig(rows)).data}
    assert shown["roll"]["x"] == [*range(1, 31), None, *range(31, 61), None]
    assert shown["mounting"]["x"] == [1, 30, None, 31, 60, None]


def posed(name, pitch, half_width, height=None, status="ok"):
    return replace(row(name, 1.0, 0.1, status), pitch_deg=pitch, pitch_ci95_deg=half_width, height_m=height)


def pose_charts(rows, rig=None):
    return [chart for name, chart in all_charts(rows, rig).items() if name in ("pitch", "height")]


def test_a_pitch_without_a_height_is_one_chart():
    assert [chart.name for chart in pose_charts([posed("a.png", 3.0, 0.1), posed("b.png", 3.2, None)])] == [
        "pitch"
    ]
    both = pose_charts([posed("a.png", 3.0, 0.1, 1.6)])
    assert [chart.name for chart in both] == ["pitch", "height"]
    assert both[1].layout["yaxis"]["title"]["text"] == "height, m"


def test_a_height_has_jumps_and_segments_and_no_line_leads_to_another_drive():
    rng = np.random.default_rng(4)
    rows = [
        replace(posed(f"{folder}/{place}.png", 3.0, 0.05), height_m=1.5 + jump + noise, height_ci95_m=0.01)
        for folder, jump in (("monday", 0.0), ("tuesday", 0.2))
        for place, noise in enumerate(rng.normal(0, 0.01, 200))
    ]
    for place in range(300, 400):
        rows[place] = replace(rows[place], height_m=rows[place].height_m + 0.1)
    pitch, height = pose_charts(rows, assess_rig(rows))
    shown = traces_of(height)
    assert shown["mounting"]["x"] == [1, 200, None, 201, 300, None, 301, 400, None]
    assert shown["mounting"]["y"][::3] == pytest.approx([1.5, 1.7, 1.8], abs=0.01)
    assert shown["mounting"]["text"][0].startswith("mounting height 1.50")
    assert shown["jump"]["x"] == [300.5, 300.5, None]
    assert shown["height"]["x"][199:202] == [200, None, 201]
    assert "jump" not in traces_of(pitch)


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


def test_pairs_of_unknown_size_are_not_in_the_chart_of_shifts():
    pair = replace(row("a.png"), right_lower_px=0.5, right_clockwise_deg=0.2)
    rows = [pair, replace(pair, width=None, height=None), pair]
    shown = traces_of(all_charts(rows)["alignment"])
    assert (shown["lower"]["x"], shown["lower"]["y"]) == ([1, 3], [0.5, 0.5])
    assert shown["turned"]["y"] == pytest.approx([np.radians(0.2) * 80] * 2, abs=2e-3)


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
