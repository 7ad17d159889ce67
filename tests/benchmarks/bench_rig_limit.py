"""How often any test could find a jump of half a degree and tell it from a drift, where the noise is known.

    python tests/benchmarks/bench_rig_limit.py [series] [first seed]

Generalised least squares with the true covariance of each series: no estimate of the noise, one jump or one
line. A jump counts as found when its gain in -2 log likelihood is above that of 95 % of the series without
one, and as told from a drift when it beats the line by more than in 95 % of the series that drift.
`bench_rig.py` shows what `rollcli rig` reaches, which knows none of this.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()

import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz

from tests.rig.drive.series import drive

FRAMES, EVERY, MARGIN = 2000, 8, 40  # jumps are looked for at every 8th frame, 40 from both ends
SETTINGS = [(0.90, 0.1), (0.94, 0.2), (0.94, 0.3), (0.97, 0.4)]  # phi, sd in degrees
WORLDS = ("nothing", "jump", "drift")


def gains(world: str, phi: float, sd: float, seed: int) -> tuple[float, float]:
    """Return what a line and what the best jump explain of a series, in -2 log likelihood."""
    at = int(np.random.default_rng(seed + 1).uniform(0.25, 0.75) * FRAMES)
    values, errors = drive(
        seed, FRAMES, phi=phi, sd=sd, jump=0.5 * (world == "jump"), at=at, drift=1.0 * (world == "drift")
    )
    frames = np.arange(FRAMES)
    factor = cholesky(sd**2 * toeplitz(phi**frames) + np.diag(errors**2), lower=True)
    steps = frames[:, None] >= np.arange(MARGIN, FRAMES - MARGIN, EVERY)
    columns = np.column_stack([np.ones(FRAMES), values, frames / FRAMES, steps])
    white = solve_triangular(factor, columns, lower=True)
    level = white[:, :1] / np.linalg.norm(white[:, 0])
    white = white[:, 1:] - level @ (level.T @ white[:, 1:])
    found = (white[:, 1:].T @ white[:, 0]) ** 2 / np.square(white[:, 1:]).sum(0)
    return float(found[0]), float(found[1:].max())


def main() -> None:
    """Print one line for each kind of noise."""
    series, first = [int(text) for text in sys.argv[1:3]] + [200, 500_000][len(sys.argv) - 1 :]
    print(f"{series} series of {FRAMES} frames each, seeds from {first}")
    print("  phi    sd   found   found and told from a drift")
    for phi, sd in SETTINGS:
        nothing, jump, drift = (
            np.array([gains(world, phi, sd, seed) for seed in range(first, first + series)])
            for world in WORLDS
        )
        found = jump[:, 1] > np.quantile(nothing[:, 1], 0.95)
        told = jump[:, 1] - jump[:, 0] > np.quantile(drift[:, 1] - drift[:, 0], 0.95)
        print(f"{phi:5.2f} {sd:5.1f} {found.mean():7.3f} {(found & told).mean():12.3f}", flush=True)


if __name__ == "__main__":
    main()
