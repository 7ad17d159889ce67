"""What the charts and the summary hold."""

import html
import json
import os

import pytest

from rollcli.report.charts import chart_over_frames
from rollcli.report.page import Chart, script_json
from rollcli.report.summary import input_folders, written_at
from rollcli.rig.drive.assess import assess_rig
from rollcli.rig.quantities import ROLL
from tests.report.results import row


@pytest.mark.parametrize(("frames", "bars"), [(400, True), (402, False)])
def test_suspect_marks_lie_below_the_line_and_have_no_bars_in_long_runs(frames, bars):
    rows = [row("a.png"), row("b.png", 9.0, 1.0, "suspect")] * (frames // 2)
    shown = {trace["name"]: trace for trace in chart_over_frames(rows, ROLL, assess_rig(rows)).data}
    alone = [] if bars else ["roll, alone"]
    assert list(shown) == ["95 % interval", "suspect", "roll", *alone, "mounting, 95 %", "mounting"]
    assert ("error_y" in shown["suspect"]) == bars


def test_the_time_of_a_file_is_told_in_utc_and_that_of_a_stream_is_not(tmp_path):
    (tmp_path / "rolls.csv").touch()
    os.utime(tmp_path / "rolls.csv", (86_400 * 365 + 3_720, 86_400 * 365 + 3_720))
    assert written_at(str(tmp_path / "rolls.csv")) == "1971-01-01 01:02 UTC"
    assert written_at("-") == written_at("s3://maps/rolls.csv") == written_at("a\0b") == ""


def test_frames_of_recordings_and_archives_are_from_these():
    files = ["a.png", "/a.png", "maps/a.png", "run.zip#a.png", "drive.mp4#000123", "drive.mcap#/left/map@12"]
    sources = [".", "/", "maps", "run.zip", "drive.mp4", "drive.mcap"]
    assert input_folders([row(file) for file in files]) == sources


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
