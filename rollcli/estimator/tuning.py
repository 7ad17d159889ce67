"""The tuned numbers of doubts and interval, and all of the estimator's in one record."""

import math
from dataclasses import dataclass, field

from rollcli.estimator.road.tuning import RoadTuning


@dataclass(frozen=True)
class IntervalTuning:
    """Numbers of `jackknife` and `interval_of`."""

    groups: int = 6
    """Bands and columns of the jackknife. More are less independent, fewer have fewer degrees of freedom."""
    independent_pixels: int = 100
    """Pixels that could be independent: neighbouring ones repeat each other, more do not tell more."""
    white: float = 0.2
    """Of the textbook's half-width: what makes neighbours alike shows in bands and columns, too. With 1 the
    interval covers every flat rendered road; tangents need all of it, since one shift of all disparities
    turns no road, and shows nowhere else."""
    factor: float = 0.65
    """Of the jackknife's half-width. Two thirds of it cover 0.86 of 28 real maps instead of 0.93, and 0.92 of
    24 rendered ones instead of 0.96."""
    lateral: float = 0.75
    """Of the difference between the lane's angle and that of all pixels."""
    depth: float = 0.55
    """Of the difference between the near half's angle and the far half's."""
    bend: float = 2.75
    """Of the angle by which the camber moves theta: a crown is no exact parabola."""
    depth_fade: float = 0.02
    """Units over which near turns into far."""
    whole_share: float = 0.02
    """Share of the whole that is added to a part, which may be nearly empty."""
    slant: float = 1.0
    """Growth of the interval from no roll to a right angle, by the sine of the roll."""


@dataclass(frozen=True)
class DoubtTuning:
    """Numbers of the reasons to doubt an angle; each is where an angle stops being ok."""

    near_minimum: float = 1.1
    """Times the lowest energy up to which another minimum is nearly as low."""
    other_angle: float = math.radians(2)
    """Radians by which another minimum is another answer."""
    least_score: float = 0.03
    """`Road.score` below which little of what lies ahead looks like a road. Behind a car, and with noise on
    four fifths of the pixels, right angles have 0.04 and more; wrong ones, with more noise still, 0.02."""
    least_steep_score: float = 0.18
    """The same for a plane whose horizon is far away: tables and stairs have up to 0.17."""
    steep: float = 0.5
    """Units from the centre beyond which a horizon is far away: of roads it is within 0.2, of tables 1.5."""
    rival_share: float = 0.75
    """Share of the road's score from which another plane explains the map nearly as well."""
    longest_move: float = math.radians(1)
    """Radians by which the fit to the road's pixels may move the roll of its plane."""
    bound_share: float = 0.99
    """Share of the largest roll from which a roll is at its bound."""
    noise_share: float = 0.45
    """Share of the widest interval that noise alone may make. At two thirds of it six of 28 real maps that
    are right are doubted, instead of two."""


@dataclass(frozen=True)
class Tuning:
    """Every tuned number of the estimator."""

    road: RoadTuning = field(default_factory=RoadTuning)
    interval: IntervalTuning = field(default_factory=IntervalTuning)
    doubts: DoubtTuning = field(default_factory=DoubtTuning)


TUNING = Tuning()
