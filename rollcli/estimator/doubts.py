"""Why an angle may be doubtful, in words.

Add a reason: a function that yields it, and its name in `REASONS`.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.energy import Energy
from rollcli.estimator.interval import Interval
from rollcli.estimator.road.find import Road
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.solvers.exact import CertifiedSolution
from rollcli.estimator.solvers.solution import angle_between
from rollcli.estimator.tuning import DoubtTuning

_COLUMNS = 160  # of a view that are looked at; shares need no more
_AHEAD = 0.05  # units to the horizon of a camera that looks ahead: every road fills enough of its view
_ON_ROAD = 0.03  # of the road's disparity, within which a pixel is on it


@dataclass(frozen=True)
class View:
    """A map as seen from the place of the camera over a road.

    Tables, shelves and the floors of rooms are as even as roads. But a camera that stands on a road sees
    several of its own heights to the sides, and most of the lane ahead; a road seen from close by fills it.

    Attributes
    ----------
    disparity : ndarray, shape (H, W)
        px.
    valid : ndarray of bool, shape (H, W)
    surface : Surface
        The road.
    rmse : float
        Of its pixels, px.
    """

    disparity: NDArray[Any]
    valid: NDArray[np.bool_]
    surface: Surface
    rmse: float

    @property
    def width(self) -> float:
        """How wide the view is at its bottom, camera heights."""
        (height, width), grid, model = self.disparity.shape, self.surface.grid, self.surface.model
        _, slope, bend = model.alpha
        bottom = model.along(0.0, (height - 1 - grid.centre_v) / grid.scale)
        nearest = model.disparity_along(bottom)
        return width / grid.scale * abs(slope + 2 * bend * bottom) / nearest if nearest > 0 else math.inf

    @cached_property
    def seen(self) -> tuple[float, float]:
        """Return which share of the lane is seen, and which of all that has data is on the road, 0 to 1.

        The first is the mean of the shares in the middle and in the far third of the ground.
        """
        height, width = self.disparity.shape
        step = -(-width // _COLUMNS)
        model, grid = self.surface.model, self.surface.grid
        level, slope, _ = model.alpha
        x = (np.arange(0, width, step) - grid.centre_u) / grid.scale
        y = ((np.arange(0, height, step) - grid.centre_v) / grid.scale)[:, None]
        along = model.along(x, y)
        road = model.disparity_along(along)
        d, usable = self.disparity[::step, ::step], self.valid[::step, ::step]
        lane = usable & (road > 0) & (np.abs(model.side(model.across(x, y), road)) < 1)
        on_road = usable & (np.abs(d - road) < _ON_ROAD * road + 3 * self.rmse)
        horizon = max(float(along.min()), -level / slope if slope else -np.inf)
        thirds = 3 * (along - horizon) / max(float(along.max()) - horizon, 1e-9)
        shares: list[float] = []
        for first in (0, 1):
            there = lane & (thirds >= first) & (thirds < first + 1)
            shares.append(float((on_road & there).sum()) / max(1.0, float(there.sum())))
        return float(np.mean(shares)), float(on_road.sum()) / max(1.0, float(usable.sum()))


@dataclass(frozen=True)
class Evidence:
    """What speaks for an angle and against it.

    Attributes
    ----------
    energy : Energy
        Of the pixels used.
    certified : CertifiedSolution
    road : Road or None
        None where every valid pixel is taken for road.
    surface : Surface or None
        The road's pixels, or a sample of those used; None where the map is too small for one.
    max_roll : float
        The largest abs(roll) considered, radians.
    max_interval : float
        The half-width from which an interval is too wide to be ok, radians.
    interval : Interval or None
    view : View or None
        Of a road that was looked for.
    """

    energy: Energy
    certified: CertifiedSolution
    road: Road | None
    surface: Surface | None
    max_roll: float
    max_interval: float
    interval: Interval | None
    view: View | None = None


def doubts_of(evidence: Evidence, tuning: DoubtTuning) -> list[str]:
    """Return every reason to doubt an angle, the solver's first."""
    return [doubt for reason in REASONS for doubt in reason(evidence, tuning)]


def _not_converged(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    status = evidence.certified.solution.status
    if not status.converged:
        yield status.value


def _not_global(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    if not evidence.certified.is_global:
        lowest = math.degrees(evidence.certified.minima[0].theta)
        yield f"a lower minimum of the energy lies at {lowest:.4f} degrees"


def _near_minimum(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    certified = evidence.certified
    lowest, *others = certified.minima
    for other in others if certified.is_global else ():
        far = angle_between(other.theta, certified.solution.theta) > tuning.other_angle
        if far and other.energy < tuning.near_minimum * lowest.energy:
            yield f"the energy is nearly as low at {math.degrees(other.theta):.2f} degrees"


def _grows_upward(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    _, c1, c2 = evidence.energy.plane
    theta = evidence.certified.solution.theta
    if c2 * math.cos(theta) - c1 * math.sin(theta) < 0:
        yield "the disparity grows upward, as it does in a depth map"


def _little_road(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    road = evidence.road
    if road and road.score < tuning.least_score:
        yield "little of what lies ahead looks like a road"


def _narrow_view(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view, road = evidence.view, evidence.road
    if view is None or road is None:
        return
    width = view.width
    doubted = width < tuning.narrowest
    if not doubted and width < tuning.narrow:
        seen, filled = view.seen
        hidden = filled > tuning.least_filled + tuning.filled_by_horizon * road.horizon  # by a car
        doubted = seen < tuning.least_seen and not hidden
    if doubted:
        yield f"the view is as narrow as that of a table or a room: {width:.1f} camera heights"


def _little_filled(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view, road = evidence.view, evidence.road
    if view is None or road is None or road.horizon < _AHEAD:
        return
    _, filled = view.seen
    if filled < min(tuning.filled_by_horizon * road.horizon, tuning.most_filled):
        share = f"{100 * filled:.0f} % of the pixels"
        yield f"a camera that looks down so far sees more of a road than {share}"


def _rival_plane(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    road = evidence.road
    if not road or road.score < tuning.least_score:
        return  # of a poor road any plane is a rival
    if road.rival > tuning.rival_share * road.score:
        yield "another plane, with another roll, explains the map nearly as well"


def _fit_moved(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    moved = evidence.surface.moved if evidence.surface else 0.0
    if moved > tuning.longest_move:
        yield f"the road's pixels moved the roll by {math.degrees(moved):.1f} degrees"


def _at_bound(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    road, surface = evidence.road, evidence.surface
    if road and surface and abs(surface.model.theta) > tuning.bound_share * evidence.max_roll:
        yield "the roll is at its bound, --max-roll"


def _uncertain(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    interval = evidence.interval
    if interval and interval.noise > tuning.noise_share * evidence.max_interval:
        yield f"noise and unevenness leave the angle open: ±{math.degrees(interval.noise):.2f} degrees"


def _wide_interval(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    interval = evidence.interval
    if interval and interval.half_width > evidence.max_interval:
        yield f"the interval is wide: ±{math.degrees(interval.half_width):.2f} degrees"


Reason = Callable[[Evidence, DoubtTuning], Iterator[str]]
REASONS: tuple[Reason, ...] = (
    _not_converged,
    _not_global,
    _near_minimum,
    _grows_upward,
    _little_road,
    _narrow_view,
    _little_filled,
    _rival_plane,
    _fit_moved,
    _at_bound,
    _uncertain,
    _wide_interval,
)
