"""`rollcli estimate` from the outside: the contract of names, columns, statuses and streams."""

import json
import math

import pytest

from tests.run_cli import contents, rollcli, rows_of
from tests.slow import mostly_slow

COLUMNS = (
    "file,right_file,status,roll_deg,roll_ci95_deg,pitch_deg,pitch_ci95_deg,height_m,height_ci95_m,camber,"
    "method,iterations,converged,global_minimum,rmse_px,"
    "alpha0,alpha1,alpha2,valid_fraction,road_fraction,width,height,right_lower_px,"
    "right_clockwise_deg,right_larger_percent,right_twist_px,message"
)


FRAMES = 12


def test_the_columns_are_those_of_the_contract(maps):
    done = rollcli("estimate", "maps", cwd=maps)
    assert done.status == 0
    assert done.out.splitlines()[0] == COLUMNS


def test_rows_come_in_natural_order_with_the_known_angle(maps):
    rows = rows_of(rollcli("estimate", "maps", cwd=maps).out)
    assert [row["file"] for row in rows] == [f"maps/frame{i}.png" for i in range(12)]
    truth = [math.degrees(0.01 * i) for i in range(12)]
    assert [float(row["roll_deg"]) for row in rows] == pytest.approx(truth, abs=0.05)


@pytest.mark.parametrize("several", mostly_slow([2, 3], 2))
def test_any_number_of_workers_gives_the_same_bytes(maps, several):
    for jobs in (1, several):
        images = ["--derotated", f"d{jobs}", "--vdisparity", f"v{jobs}", "--road-mask", f"r{jobs}"]
        rollcli("estimate", "maps", "-j", str(jobs), "-o", f"{jobs}.csv", *images, cwd=maps)
    assert (maps / f"{several}.csv").read_bytes() == (maps / "1.csv").read_bytes()
    for kind in "dvr":
        assert contents(maps / f"{kind}{several}") == contents(maps / f"{kind}1")


def test_a_frame_that_fails_has_a_row_that_says_why_and_the_others_still_come(maps):
    (maps / "maps" / "frame3.png").write_bytes(b"")
    done = rollcli("estimate", "maps", "-j2", cwd=maps)
    rows = rows_of(done.out)
    assert done.status == 3
    assert [row["file"] for row in rows if row["status"] == "error"] == ["maps/frame3.png"]
    assert (rows[3]["roll_deg"], rows[3]["message"]) == ("", "is empty")


def test_json_lines_say_the_same_as_csv(maps):
    rows = rows_of(rollcli("estimate", "maps", cwd=maps).out)
    done = rollcli("estimate", "maps", "--format", "jsonl", cwd=maps)
    lines = [json.loads(line) for line in done.out.splitlines()]
    assert list(lines[0]) == COLUMNS.split(",")
    assert [line["roll_deg"] for line in lines] == [float(row["roll_deg"]) for row in rows]
    assert lines[0]["converged"] is True


@pytest.mark.parametrize(("most", "doubted"), [("0.000001", True), ("90", False)])
def test_max_interval_says_which_angles_are_doubted(maps, most, doubted):
    rows = rows_of(rollcli("estimate", "maps/frame1.png", "--max-interval", most, cwd=maps).out)
    assert ["the interval is wide" in row["message"] for row in rows] == [doubted]
