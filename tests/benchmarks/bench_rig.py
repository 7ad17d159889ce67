"""How well a drive is assessed, on simulated series whose truth is known, and how long a million rows take.

    python tests/benchmarks/bench_rig.py [series] [first seed]

Series: AR(1) of the car and the road, each frame's own error drawn evenly from 0.02 to 0.3 degrees. The
numbers of `SequenceTuning` were chosen on seeds below 1,000; the default begins at 100,000.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()  # as the program does; with two, the series take twenty times as long on a busy machine

import numpy as np

from rollcli.files.results import Row, format_header, format_row
from rollcli.rig.drive.quantity import assess_sequence
from tests.rig.drive.series import ar1, drive, swaying
from tests.run_cli import command, environment

SERIES, FIRST_SEED, ROWS = 500, 100_000, 1_000_000
NEAR = 25  # frames
NOISES = [(0, 0.1), (0.5, 0.2), (0.7, 0.15), (0.9, 0.1), (0.94, 0.3), (0.97, 0.4)]  # phi, sd in degrees
SHORT = (8, 20, 60, 120, 240)  # frames
LEVEL = -0.44
# what happens, frames, phi, sd in degrees
SETTINGS = [
    ("nothing", 2000, 0.90, 0.1),
    ("nothing", 2000, 0.94, 0.3),
    ("nothing", 2000, 0.97, 0.1),
    ("nothing", 2000, 0.97, 0.4),
    ("nothing", 6000, 0.94, 0.3),
    ("jump 0.5", 2000, 0.90, 0.1),
    ("jump 0.5", 2000, 0.94, 0.2),
    ("jump 0.5", 2000, 0.94, 0.3),
    ("jump 0.5", 2000, 0.97, 0.4),
    ("drift 1", 2000, 0.90, 0.1),
    ("drift 1", 2000, 0.94, 0.3),
    ("drift 1", 4000, 0.94, 0.3),
    ("5 % gross", 2000, 0.94, 0.3),
    ("bumps", 400, 0.97, 0.2),
    ("sways", 400, 0.97, 0.2),
    ("sways", 1600, 0.97, 0.2),
]


def assess_many(what: str, frames: int, phi: float, sd: float, series: int, first: int) -> dict[str, str]:
    """One line of the table: shares of the series, from 0 to 1."""
    truth = LEVEL + 0.5 * (what in ("jump 0.5", "drift 1"))  # at the end
    found = []
    for seed in range(first, first + series):
        at = int(np.random.default_rng(seed + 1).uniform(0.25, 0.75) * frames)
        values, errors = drive(
            seed,
            frames,
            level=LEVEL,
            phi=phi,
            sd=sd,
            jump=0.5 * (what == "jump 0.5"),
            at=at,
            drift=1.0 * (what == "drift 1"),
            gross=0.05 * (what == "5 % gross"),
            bumps=0.3 * (what == "bumps"),
            sways=0.2 * (what == "sways"),
        )
        found.append((assess_sequence(values, errors), at))
    sure = [rig for rig, _ in found if rig.now.ci95 is not None]
    row = {
        "inside": np.mean([abs(rig.now.value - truth) <= rig.now.ci95 for rig in sure]),
        "without": 1 - len(sure) / series,
        "rms": np.sqrt(np.mean([(rig.now.value - truth) ** 2 for rig, _ in found])),
        "wrong": np.mean([_wrong(rig, what) for rig, at in found]),
    }
    if what == "jump 0.5":
        row["found"] = np.mean([bool(rig.jumps) for rig, _ in found])
        row["near"] = np.mean([_misses(rig, at) <= NEAR for rig, at in found if rig.jumps])
        row["miss"] = np.median([_misses(rig, at) for rig, at in found if rig.jumps])
    elif what == "drift 1":
        row["found"] = np.mean([rig.status == "drift" for rig, _ in found])
    return {name: f"{value:.3f}" for name, value in row.items()}


def _wrong(rig, what: str) -> bool:
    """Whether there is a jump that is none."""
    return len(rig.jumps) > (what == "jump 0.5")


def _misses(rig, at: int) -> int:
    return min(abs(jump.frame - at) for jump in rig.jumps)


def short_drives(series: int, first: int) -> None:
    """Print, for each cell: share inside, and the median half-width."""
    print("short drives: inside the interval, median half-width, degrees")
    inside = []
    for frames in SHORT:
        row = []
        for phi, sd in NOISES:
            held, halves = [], []
            for seed in range(first, first + series):
                rng = np.random.default_rng([seed, frames, round(100 * phi)])
                own = rng.uniform(0.015, 0.1, frames)
                values = LEVEL + ar1(rng, frames, phi, sd) + rng.normal(0, 1, frames) * own
                now = assess_sequence(values, own).now
                if now.ci95 is None:  # of eight frames one is an outlier: seven have no interval
                    continue
                held.append(abs(now.value - LEVEL) <= now.ci95)
                halves.append(now.ci95)
            inside += held
            row.append(f"{np.mean(held):.2f} {np.median(halves):.3f}")
        print(f"{frames:4}  " + "  ".join(row), flush=True)
    print(f"pooled {np.mean(inside):.3f}", flush=True)
    print("a smooth sway of 40 frames, 0.3 degrees: share inside, and of drifts whose interval leaves out 0")
    for frames in SHORT[:3]:
        held, drifts = [], []
        for seed in range(first, first + series):
            rng = np.random.default_rng([seed, frames])
            values = swaying(rng, frames, 40, 0.97, 0.3) + rng.normal(0, 0.05, frames)
            found = assess_sequence(values, np.full(frames, 0.05))
            if found.drift.ci95 is not None and found.segments[-1].mean.ci95 is not None:
                held.append(abs(found.segments[-1].mean.value) <= found.segments[-1].mean.ci95)
                drifts.append(abs(found.drift.value) > found.drift.ci95)
        print(f"{frames:4}  {np.mean(held):.2f}  {np.mean(drifts):.2f}", flush=True)


def assess_a_million() -> str:
    """Seconds and memory of `rollcli rig` on a million rows as estimate writes them."""
    values, errors = drive(1, ROWS, phi=0.94, sd=0.3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "rolls.csv")
        with path.open("wb") as file:
            file.write(format_header("csv"))
            for place in range(ROWS):
                row = Row(
                    f"maps/frame_{place:07}.png",
                    status="ok",
                    roll_deg=values[place],
                    roll_ci95_deg=1.96 * errors[place],
                    method="gd",
                    iterations=4,
                    converged=True,
                    global_minimum=True,
                    rmse_px=0.31,
                    alpha0=-31.2,
                    alpha1=0.2712,
                    alpha2=1.2e-5,
                    valid_fraction=0.62,
                    road_fraction=0.41,
                    width=1242,
                    height=375,
                )
                file.write(format_row(row, "csv"))
        start = time.perf_counter()
        line = command("rig", "rolls.csv", "--format", "json", "-q")
        done = subprocess.run(line, cwd=folder, env=environment(), capture_output=True, check=True)
        seconds = time.perf_counter() - start
        size = path.stat().st_size / 1e6
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    memory, processor = usage.ru_maxrss / 1e6, usage.ru_utime + usage.ru_stime
    start = time.perf_counter()
    assess_sequence(values, errors)
    alone = time.perf_counter() - start
    used = json.loads(done.stdout)["used"]
    return (
        f"{used:,} rows ({size:.0f} MB of CSV): {seconds:.1f} s, {processor:.1f} s of "
        f"processor, {memory:.2f} GB at most; "
        f"without reading {alone:.1f} s"
    )


def main() -> None:
    """Print one table."""
    series, first = [int(text) for text in sys.argv[1:3]] + [SERIES, FIRST_SEED][len(sys.argv) - 1 :]
    print(assess_a_million(), flush=True)
    short_drives(series, first)
    print(f"{series} series each, seeds from {first}; degrees, shares from 0 to 1, frames")
    names = ("inside", "without", "rms", "wrong", "found", "near", "miss")
    heads = (
        "inside the interval",
        "no interval",
        "rms error",
        "wrong jumps",
        "found",
        "in 25 frames",
        "off by",
    )
    print(f"{'what':10} {'frames':>6} {'phi':>5} {'sd':>4}  " + "  ".join(heads))
    for what, frames, phi, sd in SETTINGS:
        row = assess_many(what, frames, phi, sd, series, first)
        cells = "  ".join(
            f"{row.get(name, ''):>{len(head)}}" for name, head in zip(names, heads, strict=True)
        )
        print(f"{what:10} {frames:6} {phi:5} {sd:4}  {cells}", flush=True)


if __name__ == "__main__":
    main()
