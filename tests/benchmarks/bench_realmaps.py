"""How accurate and how honest the angles are on real streets with known rolls.

    python tests/benchmarks/bench_realmaps.py

The 120 maps and pairs of ../shared/realmaps: KITTI 2015, one matcher at four stages, a stereo network, and a
sequence of pairs that are matched by SGBM. The reference, from lidar or from regions placed by hand, is a
range: what valid parts of the road have. An angle is off by its distance to that range. Prints a Markdown
table; wrong: more than 0.5 degrees off and ok; needless: within 0.25 and suspect.
"""

import csv
import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matched import match_as_estimated

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.estimator.request import Request
from rollcli.files.formats import read_image

REALMAPS = Path(__file__).resolve().parents[3] / "shared" / "realmaps"
SOURCES = {
    "one matcher, four stages": ("raw", "refined", "sgm", "post"),
    "network": ("network",),
    "SGBM": ("sequence",),
}
GOOD_DEG, WRONG_DEG = 0.25, 0.5


class Outcome(NamedTuple):
    """How far an angle is off its range, its half-width, degrees, and whether it is ok."""

    off: float
    half_width: float
    ok: bool


def estimate_of(file: str) -> RollEstimate:
    """Estimate the roll of a map, or of the pair that a left image is of."""
    path = REALMAPS / file
    if path.parent.name == "left":
        right = path.parents[1] / "right" / path.name
        match = match_as_estimated(read_image(path), read_image(right))
        return estimate_roll(match.disparity, Request(slope_error=match.slope_error))
    stored = read_image(path)
    return estimate_roll(stored.astype(np.float32) / (256 if stored.dtype == np.uint16 else 1))


def outcome(row: dict[str, str]) -> Outcome:
    """Estimate one frame, and compare it with its reference."""
    estimate = estimate_of(row["file"])
    low, high = float(row["lo_deg"]), float(row["hi_deg"])
    apart = math.remainder(math.degrees(estimate.theta) - (low + high) / 2, 180)
    off = max(0.0, abs(apart) - (high - low) / 2)
    return Outcome(off, math.degrees(estimate.ci95 or 0.0), estimate.status == "ok")


def line(name: str, outcomes: list[Outcome]) -> str:
    """Return one line of the table."""
    off, half, ok = (np.array(column) for column in zip(*outcomes, strict=True))
    cells = (
        name,
        f"{len(off)}",
        f"{np.percentile(off, 95):.2f}",
        f"{off.max():.2f}",
        f"±{np.median(half):.2f}",
        f"{100 * np.mean(off <= half):.0f} %",
        f"{np.sum((off > WRONG_DEG) & ok)}",
        f"{np.sum((off <= GOOD_DEG) & ~ok)}",
    )
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Print a line for each source, and one for all."""
    if not REALMAPS.is_dir():
        print(f"left out: {REALMAPS} is not there")
        return
    with (REALMAPS / "reference.csv").open(newline="") as lines:
        rows = [row for row in csv.DictReader(lines) if row["lo_deg"]]
    print("| maps | frames | 95 % | worst | interval | covered | wrong | needless |")
    print("|---|---|---|---|---|---|---|---|")
    every: list[Outcome] = []
    for name, folders in SOURCES.items():
        found = [outcome(row) for row in rows if row["file"].split("/")[0] in folders]
        print(line(name, found))
        every += found
    print(line("all", every))


if __name__ == "__main__":
    main()
