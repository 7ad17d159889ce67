"""What a drive tells of how its right views lie, and one pair does not: `rig --correction` on real pairs.

    python tests/benchmarks/bench_correction.py [STEP]

The 41 pairs of ../shared/lidar, or every STEP-th, as a drive whose right views are turned, larger or lower.
`estimate`, `rig --correction` and `estimate --align` run as at the shell. Each angle that is ok is compared
with that of the pair as it is, found in the same way. Prints a Markdown table, in degrees.
"""

import csv
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from bench_lidar import FOCAL, LIDAR, Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.files.formats import read_image
from tests.odd_views import seen_by, seen_turned
from tests.run_cli import command, environment

WAYS: dict[str, Callable[[Image], Image]] = {
    "as they are": lambda view: view,
    "0.1 % larger": partial(seen_by, larger_percent=0.1),
    "0.3 % larger": partial(seen_by, larger_percent=0.3),
    "0.4 % smaller": partial(seen_by, larger_percent=-0.4),
    "turned by 0.1°, 0.1 % smaller, 0.5 px lower": partial(
        seen_by, clockwise_deg=0.1, larger_percent=-0.1, lower=0.5
    ),
    "turned by -0.3°, 0.2 % larger, 1 px higher": partial(
        seen_by, clockwise_deg=-0.3, larger_percent=0.2, lower=-1.0
    ),
    "turned by 0.5°, 0.6 % smaller, 2 px higher": partial(
        seen_by, clockwise_deg=0.5, larger_percent=-0.6, lower=-2.0
    ),
    **{
        f"{way} of {degrees:+.1f}°": partial(seen_turned, focal=FOCAL, **{f"{way}_deg": degrees})
        for way in ("yaw", "pitch")
        for degrees in (0.1, -0.1, 0.3, -0.3)
    },
}
Angles = dict[str, float]


def angles_of(folder: Path, step: int, change: Callable[[Image], Image]) -> tuple[Angles, Angles]:
    """Return the angles that are ok, by name: of pairs by themselves, and levelled by their correction."""
    for side in ("left", "right"):
        (folder / side).mkdir()
        for path in sorted((LIDAR / side).iterdir())[::step]:
            view = read_image(str(path))
            cv2.imwrite(str(folder / side / path.name), view if side == "left" else change(view))
    pairs = ("estimate", "--left", "left", "--right", "right", "-q", "-o")
    for line in (
        (*pairs, "alone.csv"),
        ("rig", "alone.csv", "--correction", "right.json", "-q"),
        (*pairs, "aligned.csv", "--align", "right.json"),
    ):
        subprocess.run(command(*line), cwd=folder, env=environment(), capture_output=True, check=True)
    return _read(folder / "alone.csv"), _read(folder / "aligned.csv")


def _read(path: Path) -> Angles:
    with path.open() as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "ok"]
    return {row["file"]: float(row["roll_deg"]) for row in rows}


def main() -> None:
    """Print one table."""
    if not LIDAR.is_dir():
        print(f"left out: {LIDAR} is not there")
        return
    step = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    each = "mean, moved by more than 0.1"
    print(f"| right views | each pair by itself: {each} | suspect | with `--align`: {each} | suspect |")
    print("|---|---|---|---|---|")
    known = tuple[Angles, ...]()
    for title, change in WAYS.items():
        with tempfile.TemporaryDirectory() as folder:
            found = angles_of(Path(folder), step, change)
        known = known or found
        cells = [title]
        for angles, before in zip(found, known, strict=True):
            moved = np.array([angles[name] - before[name] for name in angles if name in before])
            count, mean = len(moved), moved.mean() if len(moved) else 0.0
            above = np.count_nonzero(np.abs(moved) > 0.1)
            cells += [f"{mean:+.3f}, {above} of {count}", str(len(before) - count)]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
