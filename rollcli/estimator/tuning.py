"""The tuned numbers of doubts and interval, and all of the estimator's in one record."""

import math
from dataclasses import dataclass, field

from rollcli.estimator.road.tuning import RoadTuning


@dataclass(frozen=True)
class IntervalTuning:
    """Numbers of `half_width`."""

    groups: int = 6
    """Bands and columns of the jackknife. More are less independent, fewer have fewer degrees of freedom."""
    independent_pixels: int = 200
    """Pixels that could be independent: neighbouring ones repeat each other, more do not tell more."""
    factor: float = 0.53
    """Kappa. tests/benchmarks/fit_interval.py finds 0.42; maps of other matchers ask for more."""
    slant: float = 1.0
    """Growth of the interval from no roll to a right angle, by the sine of the roll."""


@dataclass(frozen=True)
class DoubtTuning:
    """Numbers of the reasons to doubt an angle; each is where an angle stops being ok."""

    near_minimum: float = 1.1
    """Times the lowest energy up to which another minimum is nearly as low."""
    other_angle: float = math.radians(2)
    """Radians by which another minimum is another answer."""
    least_score: float = 0.18
    """`Road.score` below which little of what lies ahead looks like a road."""
    rival_share: float = 0.75
    """Share of the road's score from which another plane explains the map nearly as well."""
    most_noise: float = 0.25
    """Share of the corridor that noise may fill."""
    longest_move: float = math.radians(1)
    """Radians by which the fit to the road's pixels may move the roll of its plane."""
    bound_share: float = 0.99
    """Share of the largest roll from which a roll is at its bound."""
    widest_interval: float = math.radians(0.25)
    """Half-width of an interval that is still narrow, radians."""


@dataclass(frozen=True)
class Tuning:
    """Every tuned number of the estimator."""

    road: RoadTuning = field(default_factory=RoadTuning)
    interval: IntervalTuning = field(default_factory=IntervalTuning)
    doubts: DoubtTuning = field(default_factory=DoubtTuning)


TUNING = Tuning()
