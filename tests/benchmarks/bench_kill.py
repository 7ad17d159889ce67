"""500 frames, killed with SIGKILL at five random moments, resumed: the bytes of an undisturbed run?

python tests/benchmarks/bench_kill.py [frames] [trials] [seed]
"""

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.run_cli import command, contents, environment, write_maps

KILLS = 5


def start(folder: Path, jobs: int, *flags: str) -> subprocess.Popen[bytes]:
    """A run that writes a result and three images a frame into the folder."""
    images = ("--derotated", "up", "--vdisparity", "v", "--road-mask", "road")
    line = command("estimate", "../maps", "-q", "-o", "rolls.csv", "-j", str(jobs), *images, *flags)
    return subprocess.Popen(line, cwd=folder, env=environment())


def seconds_undisturbed(folder: Path, jobs: int) -> float:
    """How long the whole takes."""
    folder.mkdir()
    before = time.perf_counter()
    start(folder, jobs).wait()
    return time.perf_counter() - before


def disturbed(folder: Path, jobs: int, seconds: float, chance: random.Random) -> list[int]:
    """Kill five runs, let the sixth finish; the rows that each of them left."""
    folder.mkdir()
    rows = []
    for _ in range(KILLS):
        run = start(folder, jobs, "--resume")
        time.sleep(chance.uniform(0, 2 * seconds / KILLS))
        run.kill()
        run.wait()
        result = folder / "rolls.csv"
        rows.append(result.read_bytes().count(b"\n") if result.exists() else 0)
    start(folder, jobs, "--resume").wait()
    return rows


def main() -> None:
    """Print one line a trial."""
    frames, trials, seed = [int(text) for text in sys.argv[1:4]] + [500, 3, 0][len(sys.argv) - 1 :]
    chance, same = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_maps(folder / "maps", frames, width=320, height=240)
        seconds = seconds_undisturbed(folder / "undisturbed", 2)
        expected = contents(folder / "undisturbed")
        for trial in range(trials):
            jobs = 1 + trial % 2
            rows = disturbed(folder / f"trial{trial}", jobs, seconds, chance)
            equal = contents(folder / f"trial{trial}") == expected
            same += equal
            print(
                f"-j{jobs}, killed after {rows} lines: {'the same bytes' if equal else 'DIFFERENT'}",
                flush=True,
            )
    print(f"{same} of {trials} trials ended in the bytes of an undisturbed run ({len(expected)} files)")


if __name__ == "__main__":
    main()
