"""The page of 10,000 frames: how long it takes to make, how large it is, and how soon a browser shows it.

python tests/benchmarks/bench_report.py [frames] [rounds]
"""

import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from rollcli.files.results import Row, format_header, format_row
from tests.conftest import BROWSERS, FLAGS
from tests.run_cli import command, environment, road_map, write_kitti

MAPS = 12
LARGEST_MB, LONGEST_S = 30, 3


def write_result(folder: Path, frames: int) -> None:
    """A result of maps of 1242x375; of a hundred frames, three are suspect and one has failed."""
    for i in range(MAPS):
        write_kitti(folder / f"{i}.png", road_map(0.01 * i, width=1242, height=375, noise=0.3, seed=i))
    lines = [format_header("csv")]
    for i in range(frames):
        numbers = {"roll_deg": 0.5 * (i % MAPS), "roll_ci95_deg": 0.05, "width": 1242, "height": 375}
        row = Row(f"{i % MAPS}.png", status="suspect" if i % 100 < 3 else "ok", **numbers, message="x")
        lines.append(format_row(row if i % 100 != 50 else Row(f"{i}.png", message="is empty"), "csv"))
    (folder / "rolls.csv").write_bytes(b"".join(lines))


def seconds_to_open(page: Path, rounds: int) -> list[float] | None:
    """From the request until both charts are drawn, in a new tab each time."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        return None
    times = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(FLAGS))
        for _ in range(rounds):
            tab = browser.new_page(viewport={"width": 1280, "height": 900})
            start = time.perf_counter()
            tab.goto(page.as_uri())
            tab.wait_for_selector("#histogram .main-svg")
            times.append(time.perf_counter() - start)
            tab.close()
        browser.close()
    return times


def main() -> None:
    """Print one table."""
    frames, rounds = [int(text) for text in sys.argv[1:3]] + [10_000, 7][len(sys.argv) - 1 :]
    with tempfile.TemporaryDirectory() as folder:
        write_result(Path(folder), frames)
        page = Path(folder, "page.html")
        start = time.perf_counter()
        line = command("report", "rolls.csv", "-o", "page.html", "-q")
        subprocess.run(line, cwd=folder, env=environment(), check=True)
        made = time.perf_counter() - start
        size, times = page.stat().st_size / 1e6, seconds_to_open(page, rounds)
    print(f"{frames} frames, {MAPS} of them in pictures of 1242x375")
    print(f"made in     {made:5.1f} s")
    print(f"size        {size:5.1f} MB (at most {LARGEST_MB})")
    if times is None:
        print("opened in   no browser, or no playwright, to tell")
    else:
        print(f"opened in   {statistics.median(times):5.1f} s (at most {LONGEST_S}), median of {rounds}")


if __name__ == "__main__":
    main()
