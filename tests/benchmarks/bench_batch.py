"""What a batch costs: CPU time per frame against bare decoding, and what a second worker brings.

python tests/benchmarks/bench_batch.py [frames] [repeats]
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.program import command, environment, road_map, write_kitti  # noqa: E402

BARE = """
import sys, time, cv2, numpy as np
from pathlib import Path
cv2.setNumThreads(1)
start = time.process_time()
for path in sorted(Path(sys.argv[1]).iterdir()):
    cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
print(time.process_time() - start)
"""


def bare_seconds(folder: Path) -> float:
    """CPU seconds of decoding alone, start-up left out."""
    done = subprocess.run([sys.executable, "-c", BARE, folder], capture_output=True, text=True, check=True)
    return float(done.stdout)


def rollcli_seconds(folder: Path, jobs: int) -> tuple[float, float]:
    """Wall and CPU seconds of the whole program, start-up and workers included."""
    line = command("estimate", folder, "-q", "-j", str(jobs), "-o", folder.parent / "rolls.csv", "--overwrite")
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(line, env=environment(), check=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print one table; the figures of a round are taken one after the other, and the median round counts."""
    frames, repeats = (int(text) for text in (*sys.argv[1:], 300, 5)[:2]) if len(sys.argv) < 3 else map(int, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as folder:
        maps = Path(folder, "maps")
        for index in range(frames):
            write_kitti(maps / f"{index:04}.png", road_map(0.002 * (index % 50), width=1242, height=375, seed=index))
        rounds = []
        for _ in range(repeats):
            bare = bare_seconds(maps)
            (wall1, cpu1), (wall2, cpu2) = rollcli_seconds(maps, 1), rollcli_seconds(maps, 2)
            rounds.append((bare, cpu1, cpu1 / bare, wall1, wall2, wall1 / wall2, cpu2))
    bare, cpu1, share, wall1, wall2, gain, cpu2 = (statistics.median(column) for column in zip(*rounds, strict=True))
    each = 1000 / frames
    print(f"{frames} 16-bit PNGs of 1242x375, {os.cpu_count()} processors, median of {repeats} rounds")
    print(f"cv2.imdecode alone     {bare * each:7.2f} ms CPU a frame")
    print(f"estimate -j1 -q        {cpu1 * each:7.2f} ms CPU a frame   {share:.2f} x decoding (to reach: 1.8)")
    print(f"estimate -j2 -q        {cpu2 * each:7.2f} ms CPU a frame")
    print(f"-j1 {wall1:.2f} s, -j2 {wall2:.2f} s: -j2 is {gain:.2f} x as fast (to reach: 1.7)")


if __name__ == "__main__":
    main()
