"""What the charts of pitch and height hold."""

from dataclasses import replace

from rollcli.report.pose_charts import pose_charts
from tests.report.results import row


def posed(name, pitch, half_width, height=None, status="ok"):
    return replace(row(name, 1.0, 0.1, status), pitch_deg=pitch, pitch_ci95_deg=half_width, height_m=height)


ROWS = [
    posed("a.png", 3.0, 0.1),
    posed("b.png", 3.2, 0.2),
    posed("c.png", 9.0, 0.1, status="suspect"),
    posed("<b>.png", 3.4, None),
    posed("e.png", 3.1, 0.1),
]


def traces(chart):
    return {trace["name"]: trace for trace in chart.data}


def test_without_a_calibration_there_are_no_charts():
    assert pose_charts([row("a.png", 1.0, 0.1), row("b.png", None)]) == []


def test_a_pitch_without_a_height_is_one_chart():
    assert [chart.name for chart in pose_charts(ROWS)] == ["pitch"]
    both = pose_charts([posed("a.png", 3.0, 0.1, 1.6)])
    assert [chart.name for chart in both] == ["pitch", "height"]
    assert both[1].layout["yaxis"]["title"]["text"] == "height, m"


def test_the_line_breaks_at_suspect_frames_which_have_marks():
    (chart,) = pose_charts(ROWS)
    shown = traces(chart)
    assert shown["pitch"]["x"] == [1, 2, None, 4, 5]
    assert shown["pitch"]["y"] == [3.0, 3.2, None, 3.4, 3.1]
    assert (shown["suspect"]["x"], shown["suspect"]["y"]) == ([3], [9.0])


def test_the_band_is_the_interval_and_breaks_where_there_is_none():
    band = traces(pose_charts(ROWS)[0])["95 % interval"]
    assert band["x"] == [1, 2, 2, 1, None, 5, 5, None]
    assert band["y"] == [3.1, 3.4, 3.0, 2.9, None, 3.2, 3.0, None]


def test_file_names_are_no_tags():
    label = traces(pose_charts(ROWS)[0])["pitch"]["customdata"][3]
    assert label == "&lt;b&gt;.png<br>3.40 degrees"
