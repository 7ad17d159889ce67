"""The page of 10,000 frames: how long it takes to make, how large it is, and how soon a browser shows it.

Beside it a bare table of as many rows, in the same browser, in turns: on a busy machine only their ratio and
the CPU time say something.

python tests/benchmarks/bench_report.py [frames] [rounds]
"""

import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from rollcli.files.results import Row, format_header, format_row
from tests.conftest import BROWSERS, FLAGS
from tests.run_cli import command, environment, road_map, write_kitti

MAPS = 12
LARGEST_MB, LONGEST_S = 30, 2


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


def write_yardstick(path: Path, frames: int) -> None:
    """Write what a page of so many frames costs at least: a table of them, without scripts or pictures."""
    rows = "".join(f"<tr><td>{i}<td>maps/{i % MAPS}.png<td>ok<td>+0.50° ± 0.05°\n" for i in range(frames))
    path.write_text(f"<!doctype html><meta charset=utf-8><title>table</title><table>{rows}</table>", "utf-8")


class Opened(NamedTuple):
    """CPU time of the tab and time since the request, s: when the page is in view, when its charts answer."""

    shown_cpu: float
    shown: float
    drawn_cpu: float
    drawn: float


def open_in_turns(pages: Sequence[Path], rounds: int) -> list[list[Opened]] | None:
    """Open the pages in turns, in a new tab each time; None without a browser.

    Charts are drawn by plotly once the page is in view and idle. That work is held back until the CPU time so
    far is taken, then let go.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        return None
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(FLAGS))
        opened = [[_open(browser, page) for page in pages] for _ in range(rounds)]
        browser.close()
    return [list(each) for each in zip(*opened, strict=True)]


def _open(browser: Any, page: Path) -> Opened:
    tab = browser.new_page(viewport={"width": 1280, "height": 900})
    tab.add_init_script("window.held = []; window.requestIdleCallback = work => held.push(work);")
    session = tab.context.new_cdp_session(tab)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    start = time.perf_counter()
    tab.goto(page.as_uri())
    tab.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done)))")  # painted
    shown, shown_cpu = time.perf_counter() - start, _cpu(session)
    tab.evaluate(
        "window.requestIdleCallback = work => setTimeout(work); held.forEach(work => setTimeout(work))"
    )
    if tab.locator("#histogram").count():
        tab.wait_for_selector("#histogram .main-svg")
    drawn, drawn_cpu = time.perf_counter() - start, _cpu(session)
    tab.close()
    return Opened(shown_cpu, shown, drawn_cpu, drawn)


def _cpu(session: Any) -> float:
    """Seconds that the tab's main thread has run: parsing, scripts, styles, layout and painting."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(float(each["value"]) for each in metrics if each["name"] == "TaskDuration")


def main() -> None:
    """Print one table."""
    frames, rounds = [int(text) for text in sys.argv[1:3]] + [10_000, 7][len(sys.argv) - 1 :]
    with tempfile.TemporaryDirectory() as folder:
        write_result(Path(folder), frames)
        page, table = Path(folder, "page.html"), Path(folder, "table.html")
        write_yardstick(table, frames)
        start = time.perf_counter()
        line = command("report", "rolls.csv", "-o", "page.html", "-q")
        subprocess.run(line, cwd=folder, env=environment(), check=True)
        made = time.perf_counter() - start
        size, found = page.stat().st_size / 1e6, open_in_turns([table, page], rounds)
    print(f"{frames} frames, {MAPS} of them in pictures of 1242x375")
    print(f"made in     {made:5.1f} s")
    print(f"size        {size:5.1f} MB (at most {LARGEST_MB})")
    if found is None:
        print("opened in   no browser, or no playwright, to tell")
        return
    print(f"medians of {rounds}, s              CPU   clock")
    for what, times in zip(("a bare table of as many rows", "the page"), found, strict=True):
        each = [statistics.median(values) for values in zip(*times, strict=True)]
        print(f"{what + ', in view':28} {each[0]:7.2f} {each[1]:7.2f}")
    print(f"{'the page, charts answer':28} {each[2]:7.2f} {each[3]:7.2f} (CPU: at most {LONGEST_S})")


if __name__ == "__main__":
    main()
