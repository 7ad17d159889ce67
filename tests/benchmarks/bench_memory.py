"""Whether memory grows with the number of frames: peak resident memory of 2,000 and of 20,000 small frames.

python tests/benchmarks/bench_memory.py [few] [many]
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.run_cli import command, environment, road_map, write_kitti

# in a process of its own, since the peak is that of the largest child so far
RUN = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print({})"
OWN = "resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss"


def peak(folder: Path, jobs: int) -> float:
    """MiB of the largest process of a run over the folder: the program itself, or one of its workers."""
    result = folder.with_suffix(f".{jobs}.csv")
    images = ("--derotated", folder.with_suffix(f".{jobs}.up"))
    line = command("estimate", folder, "-q", "-j", str(jobs), "-o", result, *images)
    run = [sys.executable, "-c", RUN.format(OWN), *line]
    done = subprocess.run(run, env=environment(), capture_output=True, text=True, check=True)
    return float(done.stdout) / 1024


def main() -> None:
    """Print one table."""
    few, many = [int(text) for text in sys.argv[1:3]] or [2_000, 20_000]
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
