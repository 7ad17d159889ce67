"""Stamps in the names of frames: a drift an hour, the axis of time, and which frames are one drive."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rollcli.files.results import Row, format_row
from rollcli.report.charts import all_charts
from rollcli.rig.drive.assess import assess_rig, drive_of
from tests.run_cli import rollcli

START = 1_700_000_000_123_456_789
RATE = 3.0  # degrees an hour
NAME = "runs/drive.mcap#/stereo/disparity@{}"


def rows(count=600, rate=RATE, name=NAME, start=START, every_s=1.0):
    """Frames of a second each, a third of them dropped in the first half, whose roll drifts with time."""
    rng = np.random.default_rng(3)
    times = np.array([each for each in range(count) if each % 3 or each > count // 2]) * every_s
    rolls = rng.normal(0.5, 0.05, len(times)) + rate * times / 3600
    return times, [
        Row(name.format(start + round(time * 1e9)), "", "ok", roll_deg=float(roll), roll_ci95_deg=0.05)
        for time, roll in zip(times, rolls, strict=True)
    ]


@pytest.mark.slow
def test_rig_says_the_drift_an_hour_in_words_and_in_json(tmp_path):
    _, given = rows()
    lines = b"".join(format_row(each, "jsonl", ()) for each in given)
    (tmp_path / "rolls.jsonl").write_bytes(lines)
    told = rollcli("rig", "rolls.jsonl", cwd=tmp_path, status=0)
    (line,) = [each for each in told.out.splitlines() if each.startswith("drift")]
    assert " over the drive, +" in line
    assert line.endswith("° an hour")
    found = json.loads(rollcli("rig", "rolls.jsonl", "--format", "json", cwd=tmp_path).out)
    hourly = found["drift_deg_per_hour"]
    assert f"+{hourly:.2f}"[:4] in line
    assert abs(hourly - RATE) < found["drift_ci95_deg_per_hour"]
    assert found["drift_deg"] == pytest.approx(hourly * 598 / 3600, rel=1e-3)
    rollcli("report", "rolls.jsonl", "-o", "page.html", "--gallery", "0", cwd=tmp_path, status=0)
    assert "an hour" in (tmp_path / "page.html").read_text("utf-8")
    (tmp_path / "rolls.jsonl.run.json").write_text('{"options": 3}')  # of use with a calibration alone
    assert rollcli("rig", "rolls.jsonl", cwd=tmp_path, status=0).out == told.out


@pytest.mark.parametrize(
    ("whole_s", "unit", "size"),
    [(0.01, "s", 1), (119, "s", 1), (121, "min", 60), (7190, "min", 60), (7210, "h", 3600), (1e5, "h", 3600)],
)
def test_the_axis_of_charts_is_time_where_names_have_stamps(whole_s, unit, size):
    times, given = rows(every_s=whole_s / 598)
    given = [replace(each, right_lower_px=0.1, width=640, height=480) for each in given]
    given.append(Row("runs/drive.mcap#rest", "", "error", message="is cut off"))
    charts = all_charts(given, assess_rig(given))
    for name in ("roll", "alignment"):
        assert charts[name].layout["xaxis"]["title"]["text"] == f"time, {unit}"
    shown = {trace["name"]: trace for trace in charts["roll"].data}
    x = [each for each in shown["roll"]["x"] if each is not None]
    np.testing.assert_allclose(x, (times - times[0]) / size, atol=1e-6)
    assert shown["failed"]["x"] == [x[-1]]
    low, high = charts["roll"].layout["xaxis"]["range"]
    assert low <= 0
    assert high >= x[-1]
    mounting = [each for each in shown["mounting"]["x"] if each is not None]
    assert mounting == [x[0], x[-1]]


def test_the_axis_stays_that_of_frames_where_time_would_mislead():
    _, given = rows(100)
    again = rows(100, name="runs/other.mcap#/stereo/disparity@{}", start=START + 86_400 * 10**9)[1]
    for some in (
        [*given, *again],  # a day between the drives
        [*given[::-1]],  # stamps that descend
        [*given, Row("runs/a.png", "", "ok", roll_deg=0.5)],
        [replace(each, file=f"drive.mp4#{place:06d}") for place, each in enumerate(given)],
    ):
        chart = all_charts(some, assess_rig(some))["roll"]
        assert chart.layout["xaxis"]["title"]["text"] == "frame"
    assert drive_of("a/b.webm#000123") == "a/b.webm"
    mixed = assess_rig([*given[:50][::-1], *given[50:]])
    assert mixed.drift_per_hour(mixed.drives[0]).value is None
