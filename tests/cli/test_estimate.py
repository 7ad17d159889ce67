"""`rollcli estimate` from the outside: the contract of names, columns, statuses and streams."""

import pytest

from tests.run_cli import contents, rollcli
from tests.slow import mostly_slow

FRAMES = 12


@pytest.mark.parametrize("several", mostly_slow([2, 3], 2))
def test_any_number_of_workers_gives_the_same_bytes(maps, several):
    for jobs in (1, several):
        images = ["--derotated", f"d{jobs}", "--vdisparity", f"v{jobs}", "--road-mask", f"r{jobs}"]
        rollcli("estimate", "maps", "-j", str(jobs), "-o", f"{jobs}.csv", *images, cwd=maps)
    assert (maps / f"{several}.csv").read_bytes() == (maps / "1.csv").read_bytes()
    for kind in "dvr":
        assert contents(maps / f"{kind}{several}") == contents(maps / f"{kind}1")
