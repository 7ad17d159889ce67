"""Every tuned number of the sequence statistics, with its unit, its reason and its measured effect.

Effects are those of `python tests/benchmarks/bench_rig.py` on the seeds that it tunes on.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SequenceTuning:
    """The numbers that the assessment of a sequence depends on.

    Attributes
    ----------
    gross : float
        Robust standard deviations from the neighbouring frames beyond which a frame is a gross outlier.
    neighbours : int
        Frames on each side whose median a frame is compared with; odd.
    least_error : float
        Smallest own standard error of a frame, in units of the quantity: an interval of nothing must not take
        all the weight.
    correlations : tuple of float
        What of the car's and the road's own movement is left in the next cell: even in log correlation time.
    spreads : tuple of float
        Least and most standard deviation of that movement, in units of the quantity; even in log between.
    spread_steps : int
        How many there are: at 14 neighbours differ by a factor of 1.5.
    error_factors : tuple of (float, float)
        What the frames' own variances may have to be multiplied by, and the prior probability of it. Where
        they are right, doubting them widens intervals by nothing from 20 frames on.
    cells : int
        Stretches into which a longer drive is cut; their covariance is dense, so cost grows as the cube.
    fewest : int
        Frames below which there is no interval, but the spread of the frames.
    shortest : int
        Frames of the shortest stretch between two jumps, or between a jump and an end.
    shortest_share : float
        The same as a share of the drive: what is gone sooner is a bend of the road.
    jump_penalty : float
        Log odds against a jump at any one place, before the frames are seen.
    drift_penalty : float
        Log odds against a drift.
    most_jumps : int
        Jumps beyond which the search stops: a drive with more is not a mounted rig.
    """

    gross: float = 8.0
    neighbours: int = 7
    least_error: float = 1e-3
    correlations: tuple[float, ...] = (
        *(0.0, 0.3, 0.5, 0.65, 0.75, 0.82, 0.87),
        *(0.91, 0.94, 0.96, 0.975, 0.985, 0.993),
    )
    spreads: tuple[float, float] = (0.01, 1.5)
    spread_steps: int = 14
    error_factors: tuple[tuple[float, float], ...] = (
        (1 / 16, 0.1),
        (1 / 4, 0.2),
        (1, 0.4),
        (4, 0.2),
        (16, 0.1),
    )
    cells: int = 240
    fewest: int = 8
    shortest: int = 8
    shortest_share: float = 0.03
    jump_penalty: float = 5.0
    drift_penalty: float = 2.0
    most_jumps: int = 12


TUNING = SequenceTuning()
