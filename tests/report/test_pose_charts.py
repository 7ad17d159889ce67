"""What the charts of pitch and height hold."""

from dataclasses import replace

import numpy as np
import pytest

from rollcli.report.charts import all_charts
from rollcli.rig.drive.assess import assess_rig
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


def pose_charts(rows, rig=None):
    return [chart for name, chart in all_charts(rows, rig).items() if name in ("pitch", "height")]


def traces(chart):
    return {trace["name"]: trace for trace in chart.data}


def test_without_a_calibration_there_are_no_charts():
    assert list(all_charts([row("a.png", 1.0, 0.1), row("b.png", 1.2)])) == ["roll", "histogram"]
    assert list(all_charts([row("a.png", 1.0, 0.1), row("b.png", None)])) == ["roll"]


def test_a_pitch_without_a_height_is_one_chart():
    assert [chart.name for chart in pose_charts(ROWS)] == ["pitch"]
    both = pose_charts([posed("a.png", 3.0, 0.1, 1.6)])
    assert [chart.name for chart in both] == ["pitch", "height"]
    assert both[1].layout["yaxis"]["title"]["text"] == "height, m"


def test_the_line_breaks_at_suspect_frames_which_have_marks():
    (chart,) = pose_charts(ROWS)
    shown = traces(chart)
    assert shown["pitch"]["x"] == [1, 2, None, 4, 5, None]
    assert shown["pitch"]["y"] == [3.0, 3.2, None, 3.4, 3.1, None]
    assert (shown["suspect"]["x"], shown["suspect"]["y"]) == ([3], [9.0])


def test_the_band_is_the_interval_and_breaks_where_there_is_none():
    band = traces(pose_charts(ROWS)[0])["95 % interval"]
    assert band["x"] == [1, 2, 2, 1, None, 5, 5, None]
    assert band["y"] == [3.1, 3.4, 3.0, 2.9, None, 3.2, 3.0, None]


def test_file_names_are_no_tags():
    label = traces(pose_charts(ROWS)[0])["pitch"]["customdata"][3]
    assert label == "&lt;b&gt;.png<br>+3.40°"


def test_a_height_is_told_in_metres_with_as_many_decimals_as_its_interval_is_worth():
    each = replace(row("a.png"), height_m=1.6543, height_ci95_m=0.004)
    assert traces(pose_charts([each])[0])["height"]["customdata"][0] == "a.png<br>1.654 ± 0.004 m"


def test_jumps_and_segments_are_shown_and_no_line_leads_to_another_drive():
    rng = np.random.default_rng(4)
    rows = [
        replace(posed(f"{folder}/{place}.png", 3.0, 0.05), height_m=1.5 + jump + noise, height_ci95_m=0.01)
        for folder, jump in (("monday", 0.0), ("tuesday", 0.2))
        for place, noise in enumerate(rng.normal(0, 0.01, 200))
    ]
    for place in range(300, 400):
        rows[place] = replace(rows[place], height_m=rows[place].height_m + 0.1)
    pitch, height = pose_charts(rows, assess_rig(rows))
    shown = traces(height)
    assert shown["mounting"]["x"] == [1, 200, None, 201, 300, None, 301, 400, None]
    assert shown["mounting"]["y"][::3] == pytest.approx([1.5, 1.7, 1.8], abs=0.01)
    assert shown["mounting"]["text"][0].startswith("mounting height 1.50")
    assert shown["jump"]["x"] == [300.5, 300.5, None]
    assert shown["height"]["x"][199:202] == [200, None, 201]
    assert "jump" not in traces(pitch)
