"""What a batch costs: CPU time per frame against bare decoding, and what a second worker brings.

python tests/benchmarks/bench_batch.py [frames] [rounds]
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from timed import timed

from tests.run_cli import command, environment, road_map, write_kitti

BARE = """
import sys, time, cv2, numpy as np
from pathlib import Path
cv2.setNumThreads(1)
start = time.process_time()
for path in sorted(Path(sys.argv[1]).iterdir()):
    cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
print(time.process_time() - start)
"""

# what the workers do, in threads of one process: what processes were chosen over
THREADS = """
import sys, time
start = time.perf_counter()
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from rollcli.run.workers.pool import limit_blas_threads, prepare_worker
limit_blas_threads()
prepare_worker()
from rollcli.run.frame_task import run_frame
from rollcli.run.frame import Frame
from rollcli.run.options import *
options = FramesOptions()
paths = map(str, sorted(Path(sys.argv[1]).iterdir()))
frames = [Frame(path, "", path, "", Path(path).name, None) for path in paths]
with ThreadPoolExecutor(2) as pool:
    for result in pool.map(partial(run_frame, options=options), frames):
        assert result.row.status != "error"
print(time.perf_counter() - start)
"""


def own_figure(code: str, folder: Path) -> float:
    """What a script prints, in a process of its own."""
    line = [sys.executable, "-c", code, folder]
    return float(subprocess.run(line, env=environment(), capture_output=True, text=True, check=True).stdout)


def estimate(folder: Path, jobs: int, path: str = str(ROOT)) -> tuple[float, float]:
    """Wall and CPU seconds of the whole program, start-up and workers included; `path` is Python's."""
    result = folder.with_name("rolls.csv")
    line = command("estimate", folder, "-q", "-j", str(jobs), "-o", result, "--overwrite")
    # an installed program has its byte code, and so has this one, whatever the environment says
    code = str(folder.with_name("byte_code"))
    kept = environment(PYTHONPATH=path, PYTHONPYCACHEPREFIX=code, PYTHONDONTWRITEBYTECODE="")
    return timed(line, kept)


def without_extras(folder: Path) -> str:
    """Make a path for Python on which the extra `fast` seems not to be installed."""
    hidden = folder / "hidden"
    hidden.mkdir()
    (hidden / "imagecodecs.py").write_text("raise ImportError\n")
    return os.pathsep.join([str(hidden), str(ROOT)])


def measure(frames: int, rounds: int) -> dict[str, float]:
    """The median of each figure; those of a round are taken right after each other."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        maps = Path(folder, "maps")
        for i in range(frames):
            write_kitti(maps / f"{i:04}.png", road_map(0.002 * (i % 50), width=1242, height=375, seed=i))
        plain = without_extras(Path(folder))
        estimate(maps, 2)  # byte code is written, files are in memory
        for _ in range(rounds):
            bare, (wall1, cpu1), (wall2, cpu2) = own_figure(BARE, maps), estimate(maps, 1), estimate(maps, 2)
            threads, (_, cpu_plain) = own_figure(THREADS, maps), estimate(maps, 1, plain)
            found.append(
                {"bare": bare, "cpu1": cpu1, "cpu2": cpu2, "plain": cpu_plain, "wall1": wall1, "wall2": wall2}
                | {"share": cpu1 / bare, "plain_share": cpu_plain / bare}
                | {"gain": wall1 / wall2, "threads": wall1 / threads}
            )
    return {name: statistics.median(each[name] for each in found) for name in found[0]}


def main() -> None:
    """Print one table."""
    frames, rounds = [int(text) for text in sys.argv[1:3]] + [300, 5][len(sys.argv) - 1 :]
    found = measure(frames, rounds)
    cpu = {name: 1000 * found[name] / frames for name in ("bare", "cpu1", "cpu2", "plain")}
    print(f"{frames} 16-bit PNGs of 1242x375, {os.cpu_count()} processors, median of {rounds} rounds")
    print(f"cv2.imdecode alone  {cpu['bare']:6.2f} ms CPU a frame")
    print(f"estimate -j1 -q     {cpu['cpu1']:6.2f} ms, {found['share']:.2f} x decoding (to reach: 0.9)")
    print(
        f"  without `fast`    {cpu['plain']:6.2f} ms, {found['plain_share']:.2f} x decoding (to reach: 1.15)"
    )
    print(f"estimate -j2 -q     {cpu['cpu2']:6.2f} ms")
    wall = f"-j1 {found['wall1']:.2f} s, -j2 {found['wall2']:.2f} s"
    print(f"{wall}: {found['gain']:.2f} x as fast (to reach: 1.7 of 300 frames, 1.85 of 1,000)")
    print(f"two threads in place of two processes: {found['threads']:.2f} x as fast as -j1")


if __name__ == "__main__":
    main()
