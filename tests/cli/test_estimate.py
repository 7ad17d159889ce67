"""`rollcli estimate` from the outside: the contract of names, columns, statuses and streams."""

import math

import pytest

from tests.run_cli import contents, rollcli, rows_of
from tests.slow import mostly_slow

FRAMES = 12


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
