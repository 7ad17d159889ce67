"""Why an angle may be doubtful, in words.

Add a reason: a function that yields it, and its name in `REASONS`.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.interval import Interval
from rollcli.estimator.request import Request
from rollcli.estimator.road.pixels import PixelSet
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.solvers.exact import CertifiedSolution
from rollcli.estimator.solvers.solution import angle_between
from rollcli.estimator.tuning import DoubtTuning

_COLUMNS = 80  # of a view that are looked at; shares need no more
_BANDS = 20  # from the horizon to the lower border, of equal steps of the road's disparity
_ON_ROAD = 0.03  # of the road's disparity, within which a pixel is on it
_BELOW = 0.15  # of the road's disparity, by which a pixel is below it
_FEW = 8  # pixels of the lane in a band: fewer tell nothing
_ENOUGH = 0.1  # of the pixels ahead that have data: fewer tell nothing


class Ground(NamedTuple):
    """What is seen of the road's plane, shares from 0 to 1.

    Attributes
    ----------
    filled : float
        Of all pixels with data, those on the plane.
    below : float
        Of the lane's pixels those below the plane: the most in any band within twice the reach.
    beyond : float
        Of the pixels with data from the reach to twice as far, those on the plane; 1 where few have data.
    """

    filled: float
    below: float
    beyond: float


@dataclass(frozen=True)
class View:
    """A map as seen from the place of the camera over a road.

    Tables, shelves and the floors of rooms are as even as roads. But a camera that stands on a road sees
    about its own height to the sides at least, its road fills the view the more the further down it looks,
    and the road goes on ahead: nothing lies below it there, and nothing closes it off. How far away a place
    is, is said by how wide the view is there, in camera heights, which needs no focal length.

    Attributes
    ----------
    disparity : ndarray, shape (H, W)
        px.
    valid : ndarray of bool, shape (H, W)
    surface : Surface
        The road.
    rmse : float
        Of its pixels, px.
    reach : float
        How far a road goes on at least: to where the view is so many camera heights wide.
    """

    disparity: NDArray[Any]
    valid: NDArray[np.bool_]
    surface: Surface
    rmse: float
    reach: float

    def _in_the_middle(self, row: int) -> tuple[float, float]:
        """Return the road's disparity, px, in the middle of a row, and its slope there, px per unit."""
        grid, model = self.surface.grid, self.surface.model
        along = model.along(0.0, (row - grid.centre_v) / grid.scale)
        _, slope, bend = model.alpha
        return model.disparity_along(along), abs(slope + 2 * bend * along)

    @property
    def width(self) -> float:
        """How wide the view is at its bottom, camera heights."""
        height, width = self.disparity.shape
        nearest, slope = self._in_the_middle(height - 1)
        return width / self.surface.grid.scale * slope / nearest if nearest > 0 else math.inf

    @cached_property
    def ground(self) -> Ground:
        """What is seen of the road's plane.

        Where the upper border lets it be seen less than twice as far as the reach, what is beyond half as
        far as that counts for what is beyond the reach.
        """
        height, width = self.disparity.shape
        step = -(-width // _COLUMNS)
        model, grid = self.surface.model, self.surface.grid
        x = (np.arange(0, width, step) - grid.centre_u) / grid.scale
        y = ((np.arange(0, height, step) - grid.centre_v) / grid.scale)[:, None]
        road = model.disparity_along(model.along(x, y))
        d, valid = self.disparity[::step, ::step], self.valid[::step, ::step]
        lane = (road > 0) & (np.abs(model.side(model.across(x, y), road)) < 1)
        on_road = valid & (np.abs(d - road) < _ON_ROAD * road + 3 * self.rmse)
        below = valid & (d < (1 - _BELOW) * road - 3 * self.rmse)
        nearest, farthest = (self._in_the_middle(row)[0] for row in (height - 1, 0))
        nearest = max(nearest, 1e-9)  # a road may end above the border: then nothing is said of what is ahead
        near = road * (1 / nearest)  # 1 at the lower border, 0 at the horizon
        at_reach = self.width / self.reach
        bands = np.clip(near * _BANDS, 0, _BANDS - 1).astype(np.intp)
        in_lane, lower = (np.bincount(bands[those], minlength=_BANDS) for those in (lane, lane & below))
        some = (in_lane >= _FEW) & (np.arange(_BANDS) + 0.5 >= _BANDS / 2 * at_reach)
        begins = max(at_reach, 2 * farthest / nearest)
        ahead = (near < begins) & (near > begins / 2)
        seen = valid & ahead
        return Ground(
            filled=float(on_road.sum()) / max(1.0, float(valid.sum())),
            below=float(np.max(lower[some] / in_lane[some], initial=0)),
            beyond=float(on_road[seen].mean()) if seen.sum() > _ENOUGH * ahead.sum() else 1.0,
        )


@dataclass(frozen=True)
class Evidence:
    """What speaks for an angle and against it.

    Attributes
    ----------
    pixels : PixelSet
        What the angle rests on.
    request : Request
    certified : CertifiedSolution
    interval : Interval or None
    view : View or None
        Of a road that was looked for.
    """

    pixels: PixelSet
    request: Request
    certified: CertifiedSolution
    interval: Interval | None
    view: View | None


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
    _, c1, c2 = evidence.pixels.energy.plane
    theta = evidence.certified.solution.theta
    if c2 * math.cos(theta) - c1 * math.sin(theta) < 0:
        yield "the disparity grows upward, as it does in a depth map"


def _narrow_view(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view = evidence.view
    if view and view.width < tuning.narrowest:
        yield f"the view is as narrow as that of a table: {view.width:.1f} camera heights"


def _little_filled(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view, road = evidence.view, evidence.pixels.road
    if view is None or road is None:
        return
    if view.ground.filled < min(tuning.filled_by_horizon * road.horizon, tuning.most_filled):
        share = f"{100 * view.ground.filled:.0f} % of the pixels"
        yield f"a camera that looks down so far sees more of a road than {share}"


def _plane_ends(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view = evidence.view
    if view and view.ground.below > tuning.most_below:
        yield "the plane ends near ahead, as a table does: what is seen there lies below it"


def _closed_off(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    view = evidence.view
    if view and view.ground.beyond < tuning.least_beyond:
        yield "the plane is closed off near ahead, as the floor of a room is"


def _rival_plane(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    road = evidence.pixels.road
    if road and road.rival > tuning.rival_share * road.score:
        yield "another plane, with another roll, explains the map nearly as well"


def _fit_moved(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    moved = evidence.pixels.surface.moved if evidence.pixels.surface else 0.0
    if moved > tuning.longest_move:
        yield f"the road's pixels moved the roll by {math.degrees(moved):.1f} degrees"


def _at_bound(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    road, surface = evidence.pixels.road, evidence.pixels.surface
    if road and surface and abs(surface.model.theta) > tuning.bound_share * evidence.request.max_roll:
        yield "the roll is at its bound, --max-roll"


def _uncertain(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    interval = evidence.interval
    if interval and interval.noise > tuning.noise_share * evidence.request.max_interval:
        yield f"noise and unevenness leave the angle open: ±{math.degrees(interval.noise):.2f} degrees"


def _wide_interval(evidence: Evidence, tuning: DoubtTuning) -> Iterator[str]:
    interval = evidence.interval
    if interval and interval.half_width > evidence.request.max_interval:
        yield f"the interval is wide: ±{math.degrees(interval.half_width):.2f} degrees"


Reason = Callable[[Evidence, DoubtTuning], Iterator[str]]
REASONS: tuple[Reason, ...] = (
    _not_converged,
    _not_global,
    _near_minimum,
    _grows_upward,
    _narrow_view,
    _little_filled,
    _plane_ends,
    _closed_off,
    _rival_plane,
    _fit_moved,
    _at_bound,
    _uncertain,
    _wide_interval,
)
