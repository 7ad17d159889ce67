"""What a frame costs everyone who takes part, and what that means for 1 to 1,000 workers.

python tests/benchmarks/bench_scale.py [--frames 3000] [--simulated 64 256] [--seconds 20]

Measured with two local workers and two Dask workers, by CPU time beyond start-up: the difference between a
run of many frames and one of few. Simulated workers sleep for the time of a frame.
"""

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.object_store import object_store
from tests.run_cli import environment, road_map, write_kitti

FEW = 200
KINDS = 50  # of maps; the others are links to them
MAP_S, PAIR_S = 0.0055, 0.1  # of a map of 1242x375 and of a pair of that size, on one worker
REQUEST_S, CHUNKS = 0.05, 200
LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
# the program, which tells the CPU seconds of itself and of its workers
MEASURED = """
import json, resource, sys
if __name__ == "__main__":
    from rollcli.__main__ import main
    try:
        main()
    except SystemExit as end:
        if end.code:
            raise
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print(json.dumps([each.ru_utime + each.ru_stime for each in used]))
"""
_owed: dict[int, float] = {}


def sleep_for(seconds: float) -> int:
    """Take the time of a frame, in naps of a quarter of a second: shorter ones take CPU time."""
    me, now = threading.get_ident(), time.monotonic()
    idle = _owed.get(me, 0.0) < now - 0.01
    _owed[me] = (now if idle else _owed[me]) + seconds
    if idle or _owed[me] - now > 0.25:
        time.sleep(max(_owed[me] - time.monotonic(), 0.0))
    return 0


def lost(task: float, reason: str) -> int:
    """Make the result of a frame that is lost."""
    return 1


def cpu_of(processes: list["subprocess.Popen[bytes]"]) -> float:
    """CPU seconds of living processes so far."""
    ticks = 0
    for process in processes:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def dask(folder: Path, kind: str, *arguments: object) -> "subprocess.Popen[bytes]":
    """Start a Dask process with the settings that `rollcli/run/README.md` names: it rests while it waits."""
    line = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, arguments)]
    settings = environment(
        DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED="false", DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL="1s"
    )
    with (folder / f"{kind}.log").open("ab") as log:
        return subprocess.Popen(line, cwd=folder, env=settings, stdout=log, stderr=log)


@contextlib.contextmanager
def cluster(
    folder: Path, workers: int, threads: int
) -> Iterator[tuple[str, list["subprocess.Popen[bytes]"]]]:
    """Start a scheduler and workers; yield its file and the processes, the scheduler's first."""
    state = folder / "scheduler.json"
    processes = [dask(folder, "scheduler", *LOCAL, "--port", 0, "--scheduler-file", state)]
    try:
        while not (state.exists() and state.read_text().endswith("}")):
            time.sleep(0.1)
        for number in range(workers):
            place = folder / f"worker{number}"
            place.mkdir()
            more = ("--scheduler-file", state, "--nthreads", threads, "--no-nanny")
            processes.append(dask(place, "worker", *LOCAL, *more))
        yield str(state), processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


def write_inputs(folder: Path, count: int, name: str) -> Path:
    """Write a folder of maps, most of them links."""
    for number in range(count):
        path = folder / name / f"{number:06}.png"
        if number < KINDS:
            write_kitti(path, road_map(0.002 * number, width=96, height=72, seed=number))
        else:
            path.symlink_to(folder / name / f"{number % KINDS:06}.png")
    return folder / name


def run(maps: Path, output: str, *more: str) -> tuple[float, float]:
    """Estimate a folder; the CPU seconds of the program and of the processes that it started."""
    line = [sys.executable, maps.parent / "measured.py", "estimate", maps, "-q", "--overwrite"]
    line += ["-o", str(maps.parent / output), *more]
    done = subprocess.run(line, env=environment(), check=True, stdout=subprocess.PIPE, cwd=maps.parent)
    own, children = json.loads(done.stdout)
    return own, children


def beyond_start(
    measure: Callable[[Path], tuple[float, ...]], few: Path, many: Path, count: int
) -> list[float]:
    """What a frame costs, ms: many frames less few."""
    measure(few)  # loads what is loaded once
    return [1000 * (a - b) / (count - FEW) for a, b in zip(measure(many), measure(few), strict=True)]


def costs(frames: int) -> dict[str, float]:
    """CPU of a frame, ms, by who spends it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "measured.py").write_text(MEASURED)
        few, many = write_inputs(folder, FEW, "few"), write_inputs(folder, frames, "many")
        parent, worker = beyond_start(lambda maps: run(maps, "rolls.csv", "-j", "2"), few, many, frames)
        (alone,) = beyond_start(lambda maps: run(maps, "rolls.csv", "-j", "1")[:1], few, many, frames)
        with cluster(folder, 2, 1) as (scheduler, processes):

            def on_cluster(output: str) -> Callable[[Path], tuple[float, ...]]:
                def measure(maps: Path) -> tuple[float, ...]:
                    before = time.monotonic(), cpu_of(processes[:1]), cpu_of(processes[1:])
                    own, _ = run(maps, output, "--scheduler", scheduler)
                    after = time.monotonic(), cpu_of(processes[:1]), cpu_of(processes[1:])
                    return own, *(a - b for a, b in zip(after, before, strict=True))

                return measure

            driver, wall, dispatch, far = beyond_start(on_cluster("rolls.csv"), few, many, frames)
            in_parts = beyond_start(on_cluster("rolls.parquet"), few, many, frames)
            handing_over = chunk_costs(scheduler, processes)
    return {
        "alone": alone,
        "parent": parent,
        "local worker": worker,
        "driver": driver,
        "scheduler": dispatch,
        "  of it, as if idle": wall / 1000 * handing_over["scheduler, a second"],
        "Dask worker": far,
        "driver, parts": in_parts[0],
        **handing_over,
        "worker, a part of 1000": part_cost(),
        "worker, a request": request_cost(),
    }


def chunk_costs(scheduler: str, processes: list["subprocess.Popen[bytes]"]) -> dict[str, float]:
    """CPU that a chunk costs, ms, and a second in which nothing happens."""
    from rollcli.run.workers.chunks import Work, Workers
    from rollcli.run.workers.cluster import ClusterExecutor
    from tests.benchmarks import bench_scale  # workers find the tasks there, not in __main__

    def used() -> tuple[float, float, float]:
        return time.monotonic(), time.process_time(), cpu_of(processes[:1])

    executor = ClusterExecutor(scheduler, Work(bench_scale.sleep_for, bench_scale.lost), Workers())
    try:
        before = used()
        time.sleep(10)
        wall, _, idle = (after - b for after, b in zip(used(), before, strict=True))
        idle /= wall
        before = used()
        for future in [executor.submit([0.01]) for _ in range(CHUNKS)]:
            while not future.done():
                executor.wait(future)
            future.result()
        wall, own, dispatch = (after - b for after, b in zip(used(), before, strict=True))
    finally:
        executor.close(at_once=False)
    each = 1000 / CHUNKS
    return {"driver, a chunk": each * own, "scheduler, a chunk": each * (dispatch - wall * idle)} | {
        "scheduler, a second": 1000 * idle
    }


def part_cost() -> float:
    """CPU of making and writing a part of Parquet of 1,000 rows, and what they were made from, ms."""
    from rollcli.files.results import Row, format_row
    from rollcli.run.batch import BatchOptions
    from rollcli.run.options import EstimateOptions, ResultOptions

    rows = [format_row(Row(f"maps/{n:06}.png", status="ok", roll_deg=n / 1000), "jsonl") for n in range(1000)]
    with tempfile.TemporaryDirectory() as folder:
        told = EstimateOptions(result=ResultOptions(format="parquet"))
        parts = BatchOptions(told, output=f"{folder}/rolls.parquet")
        notes = [bytes(51)] * len(rows)
        parts.write(0, rows, notes)  # loads what is loaded once
        start = time.process_time()
        for number in range(1, 11):
            parts.write(number, rows, notes)
        return 100 * (time.process_time() - start)


def request_cost() -> float:
    """CPU of reading an object of 150 kB, ms."""
    from rollcli.files.storage import read_bytes, write_bytes

    with object_store() as settings:
        os.environ.update(settings)
        write_bytes("s3://maps/a", bytes(150_000))
        start = time.process_time()
        for _ in range(200):
            read_bytes("s3://maps/a")
        return 5 * (time.process_time() - start)


def busy(workers: int, frame_s: float, seconds: float) -> tuple[float, list[float]]:
    """How busy simulated workers are, and what the driver, the scheduler and the workers take of a CPU.

    Busy is the share of the time from the first chunk to the last result that they sleep for frames.
    """
    from rollcli.run.workers.chunks import Work, Workers
    from rollcli.run.workers.interrupt import Stop
    from rollcli.run.workers.tasks import run_tasks
    from tests.benchmarks import bench_scale  # workers find the tasks there, not in __main__

    tasks = [frame_s] * int(workers * seconds / frame_s)
    work = Work(bench_scale.sleep_for, bench_scale.lost)
    with (
        tempfile.TemporaryDirectory() as name,
        cluster(Path(name), 4, workers // 4) as (scheduler, processes),
    ):

        def used() -> list[float]:
            return [time.process_time(), cpu_of(processes[:1]), cpu_of(processes[1:])]

        time.sleep(10)  # the workers join
        list(run_tasks(tasks[: 2 * workers], work, Stop(), Workers(scheduler=scheduler)))
        start, before = time.monotonic(), used()
        lost_frames = sum(run_tasks(tasks, work, Stop(), Workers(scheduler=scheduler)))
        wall = time.monotonic() - start
        shares = [(after - used_before) / wall for after, used_before in zip(used(), before, strict=True)]
    return 0.0 if lost_frames else len(tasks) * frame_s / (workers * wall), shares


def print_model(found: dict[str, float]) -> None:
    """Frames a second by the number of workers: the least of what each part of a run can do.

    A chunk is worth a second, and more where there are more than 100 workers. A frame of a bucket is two
    requests, one to read it and one to write an image; a part is two more. A worker has 16 frames in hand, so
    that requests of 50 ms keep it waiting only where a frame takes less than 6 ms.
    """
    places = (("disk", "driver", 0), ("Parquet", "driver, parts", 0), ("bucket", "driver, parts", 2))
    cases = [(kind, s, *place) for kind, s in (("maps", MAP_S), ("pairs", PAIR_S)) for place in places]
    print("\nframes/s and what limits them")
    print(f"{'workers':>8}" + "".join(f"{f'{kind}, {where}':>22}" for kind, _, where, _, _ in cases))
    for workers in (1, 16, 64, 256, 1000):
        row = f"{workers:8}"
        for _, frame_s, where, driver, requests in cases:
            of_part = found["worker, a part of 1000"] / 1000 if where != "disk" else 0.0
            busy_s = frame_s + (of_part + requests * 1.002 * found["worker, a request"]) / 1000
            in_chunk = min(max(1, workers / 100), 8) / busy_s
            dispatch = found["scheduler, a chunk"] / in_chunk / (1 - found["scheduler, a second"] / 1000)
            able = {
                "workers": workers / max(busy_s, requests * REQUEST_S / 16),
                "driver": 1000 / max(found[driver] + found["driver, a chunk"] / in_chunk, 1e-3),
                "scheduler": 1000 / max(dispatch, 1e-3),
            }
            limit = min(able, key=lambda each: able[each])
            row += f"{able[limit]:12.0f} {limit:9}"
        print(row)


def main() -> None:
    """Print what was measured, the model, and how busy simulated workers are."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--frames", type=int, default=3000)
    parser.add_argument("--simulated", type=int, nargs="*", default=[64, 256])
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
    if given.frames:
        found = costs(given.frames)
        print(f"CPU of a frame, ms, {given.frames} maps of 96x72, beyond start-up (to reach: driver and")
        print(
            "scheduler 0.1 each, Dask worker 1.15 times the local one); then of a chunk, a part and a request"
        )
        for who, cost in found.items():
            print(f"{who:22} {cost:7.3f}")
        print(f"Dask worker / local worker {found['Dask worker'] / found['local worker']:.2f}")
        print_model(found)
    for workers in given.simulated:
        share, (driver, scheduler, slept) = busy(workers, 0.005, given.seconds)
        print(
            f"{workers} simulated workers, 5 ms a frame: {100 * share:.0f} % busy (to reach: 80); "
            f"driver {driver:.2f}, scheduler {scheduler:.2f}, workers {slept:.2f} of a CPU",
            flush=True,
        )


if __name__ == "__main__":
    main()
