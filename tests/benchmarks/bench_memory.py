"""Whether memory grows with the number of frames: peak resident memory of 2,000 and of 20,000 small frames.

Then what it takes to list, sort and plan 1,000,000 names, with images to write, in a dry run.

python tests/benchmarks/bench_memory.py [few] [many] [names]
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.run_cli import command, environment, road_map, write_kitti

# in a process of its own, since the peak is that of the largest child so far
RUN = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print({})"
OWN = "resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss"
TIMES = "*resource.getrusage(resource.RUSAGE_CHILDREN)[:2]"  # in user mode and in the system's
PER_FOLDER = 10_000


def peak(folder: Path, jobs: int) -> float:
    """MiB of the largest process of a run over the folder: the program itself, or one of its workers."""
    result = folder.with_suffix(f".{jobs}.csv")
    images = ("--derotated", folder.with_suffix(f".{jobs}.up"))
    line = command("estimate", folder, "-q", "-j", str(jobs), "-o", result, *images)
    run = [sys.executable, "-c", RUN.format(OWN), *line]
    done = subprocess.run(run, env=environment(), capture_output=True, text=True, check=True)
    return float(done.stdout) / 1024


def plan(folder: Path, names: int) -> tuple[float, float, float]:
    """Wall and CPU seconds, and MiB, of a dry run over so many empty files."""
    for index in range(names):
        place = folder / f"drive{index // PER_FOLDER:03}"
        if index % PER_FOLDER == 0:
            place.mkdir(parents=True)
        os.close(os.open(place / f"frame{index % PER_FOLDER:06}.png", os.O_CREAT | os.O_WRONLY))
    images = ("--derotated", folder.with_name("up"))
    line = command("estimate", folder, "--recursive", "-o", folder.with_name("rolls.csv"), *images)
    run = [sys.executable, "-c", RUN.format(f"{OWN}, {TIMES}, file=sys.stderr"), *line, "--dry-run", "-j2"]
    start = time.perf_counter()
    done = subprocess.run(
        run, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=True
    )
    kilobytes, user, system = map(float, done.stderr.split())
    return time.perf_counter() - start, user + system, kilobytes / 1024


def main() -> None:
    """Print two tables."""
    few, many, names = [int(text) for text in sys.argv[1:4]] + [2_000, 20_000, 1_000_000][len(sys.argv) - 1 :]
    if many:
        compare(few, many)
    with tempfile.TemporaryDirectory() as name:
        wall, cpu, peaked = plan(Path(name, "maps"), names)
    time_taken = f"{wall:.1f} s (at most 30), {cpu:.1f} s of them CPU"
    print(f"{names} names planned in {time_taken}; {peaked:.0f} MiB (at most 600)")


def compare(few: int, many: int) -> None:
    """Print how much more memory many frames take than few."""
    with tempfile.TemporaryDirectory() as name:
        first = Path(name, "map.png")
        write_kitti(first, road_map(0.05, width=96, height=64))
        for count in (few, many):
            folder = Path(name, str(count))
            folder.mkdir()
            for index in range(count):
                os.link(first, folder / f"frame{index:06}.png")
        for jobs in (1, 2):
            less, more = peak(Path(name, str(few)), jobs), peak(Path(name, str(many)), jobs)
            growth = f"{more / less - 1:+.0%} (at most +20 %)"
            print(f"-j{jobs}: {few} frames {less:.1f} MiB, {many} frames {more:.1f} MiB, {growth}")


if __name__ == "__main__":
    main()
