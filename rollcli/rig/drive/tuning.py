"""Every tuned number of the sequence statistics, with its unit, its reason and its measured effect.

Effects are those of `python tests/benchmarks/bench_rig.py` on the seeds that it tunes on.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SequenceTuning:
    """The numbers that the assessment of a sequence depends on.

    Attributes
    ----------
    huber : float
        Standardised residual from which on a frame loses weight. Huber's 1.345 makes blocks that wander off
        count less, and intervals 13 % too short; at 2.5 it is 1 %, and gross outliers are left out before.
    gross : float
        Robust standard deviations from the neighbouring frames beyond which a frame is a gross outlier.
    neighbours : int
        Frames on each side whose median a frame is compared with; odd.
    least_error : float
        Smallest own standard error, degrees or metres: an interval of nothing must not take all the weight.
    fewest_times, most_times : float
        Block length in integrated autocorrelation times (IAT); one IAT of AR(1) is two e-folding lengths. As
        long as a dozen blocks are left, they are longer than need be.
    fewest_blocks : int
        Blocks below which there is no interval: Student's t of fewer is hardly an interval.
    enough_blocks : int
        Blocks that are left when there is a choice.
    most_blocks : int
        Longer drives get longer blocks: they need no correction, and 60 degrees of freedom are enough.
    cells : int
        Stretches into which a drive is cut for generalised least squares; dense, so cost grows as its cube.
    longest : int
        Frames beyond which neighbours are averaged before anything else, so that a million rows take seconds.
    jump_penalty : float
        Gain in -2 log likelihood that a jump must bring: it also chooses its frame among hundreds.
    scarce_penalty : float
        What is added to it, times the share of one correlation time in the drive, and half of it to the
        drift's: the noise is then uncertain too. Without a jump 95 % of the gains are below 13 at 190
        correlation times, and below 22 at 30.
    drift_penalty : float
        Gain in -2 log likelihood that a drift must bring; 6.6 is chi-squared's 99 % point.
    told_apart : float
        What a line must bring beyond its penalty, in -2 log likelihood, to be taken instead of jumps or
        beside them: a jump pays a higher penalty only since its frame is chosen.
    fewest_to_search : int
        Frames below which neither jumps nor drift are looked for: two blocks of eight frames tell nothing.
    apart : float
        Correlation times between two jumps, at most a twelfth of the drive: what is gone sooner is a bend of
        the road.
    persistence : float
        Share of a jump's size that the levels beside it must show without the step itself: a kick that fades
        is no jump.
    most_jumps : int
        Jumps beyond which the search stops: a drive with more is not a mounted rig.
    """

    huber: float = 2.5
    gross: float = 8.0
    neighbours: int = 7
    least_error: float = 1e-4
    fewest_times: float = 2.0
    most_times: float = 4.0
    fewest_blocks: int = 8
    enough_blocks: int = 12
    most_blocks: int = 60
    cells: int = 250
    longest: int = 40_000
    jump_penalty: float = 14.0
    scarce_penalty: float = 250.0
    drift_penalty: float = 6.6
    told_apart: float = 2.5
    fewest_to_search: int = 24
    apart: float = 4.0
    persistence: float = 0.5
    most_jumps: int = 12


TUNING = SequenceTuning()
