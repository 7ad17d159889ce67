"""Why an angle may be doubtful, in words.

Add a reason: an `if` that yields it, in `doubts_of`.
"""

import math
from collections.abc import Iterator

import numpy as np

from rollcli.estimator.interval import Interval
from rollcli.estimator.moments import CheckedMap
from rollcli.estimator.request import Request
from rollcli.estimator.road.model import rig_turns
from rollcli.estimator.road.pixels import PixelSet
from rollcli.estimator.road.sample import quantile
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
_NEAREST = 0.95  # of the road's pixels that lie farther away than where it is seen nearest, outliers aside
_AT_BOUND = 0.99  # of the largest roll: a search ends a little before it


def doubts_of(
    checked: CheckedMap,
    pixels: PixelSet,
    certified: CertifiedSolution,
    interval: Interval | None,
    request: Request,
) -> Iterator[str]:
    """Yield every reason to doubt an angle, the solver's first.

    Parameters
    ----------
    checked : CheckedMap
    pixels : PixelSet
        What the angle rests on.
    certified : CertifiedSolution
    interval : Interval or None
    request : Request
    """
    tuning, solution, road, surface = request.tuning.doubts, certified.solution, pixels.road, pixels.surface
    if not solution.status.converged:
        yield solution.status.value
    lowest, *others = certified.minima
    if not certified.is_global:
        yield f"a lower minimum of the energy lies at {math.degrees(lowest.theta):.4f} degrees"
        others = []
    for other in others:
        far = angle_between(other.theta, solution.theta) > tuning.other_angle
        if far and other.energy < tuning.near_minimum * lowest.energy:
            yield f"the energy is nearly as low at {math.degrees(other.theta):.2f} degrees"
    _, c1, c2 = pixels.energy.plane
    if c2 * math.cos(solution.theta) - c1 * math.sin(solution.theta) < 0:
        yield "the disparity grows upward, as it does in a depth map"
    if road and surface:
        rmse = pixels.energy.rmse(certified.energy)
        yield from _doubts_of_plane(checked, surface, rmse, road.horizon, tuning)
    if road and road.rival > tuning.rival_share * road.score:
        yield "another plane, with another roll, explains the map nearly as well"
    if surface and surface.moved > tuning.longest_move:
        yield f"the road's pixels moved the roll by {math.degrees(surface.moved):.1f} degrees"
    if road and surface and abs(surface.model.theta) > _AT_BOUND * math.atan(request.max_tangent):
        yield "the roll is at its bound, --max-roll"
    if interval is None:
        yield "too few pixels lie away from the map's border to tell how sure the angle is"
    turns = rig_turns(solution.theta, request.aspect)
    if interval and turns * interval.noise > tuning.noise_share * request.max_interval:
        yield f"noise and misfit leave the angle open: ±{math.degrees(turns * interval.noise):.2f} degrees"
    if interval and turns * interval.half_width > request.max_interval:
        yield f"the interval is wide: ±{math.degrees(turns * interval.half_width):.2f} degrees"


def _doubts_of_plane(
    checked: CheckedMap, surface: Surface, rmse: float, horizon: float, tuning: DoubtTuning
) -> Iterator[str]:
    """Yield what speaks for another plane than a road's, as a camera in its place would see it.

    Tables, shelves and the floors of rooms are as even as roads. But a camera that stands on a road sees
    about its own height to the sides at least, its road fills the view the more the further down it looks,
    and the road goes on ahead: nothing lies below it there, and nothing closes it off. How far away a place
    is, is said by how wide the view is there, in camera heights, which needs no focal length.

    Parameters
    ----------
    checked : CheckedMap
    surface : Surface
        The road.
    rmse : float
        Of its pixels, px.
    horizon : float
        Of the plane: see `Road`.
    tuning : DoubtTuning
        A road goes on to its `reach` at least. Where the upper border lets it be seen less than twice as far,
        what is beyond half as far as that counts for what is beyond the reach.
    """
    height, width = checked.values.shape
    step = -(-width // _COLUMNS)
    model, grid = surface.model, surface.grid
    x, y = grid.normalised(np.arange(0, width, step), np.arange(0, height, step)[:, None])
    along = model.along(x, y)
    road = model.disparity_along(along)
    d, valid = checked.values[::step, ::step], checked.valid[::step, ::step]
    lane = (road > 0) & (np.abs(model.side(model.lateral(model.across(x, y), along), road)) < 1)
    on_road = valid & (np.abs(d - road) < _ON_ROAD * road + 3 * rmse)
    below = valid & (d < (1 - _BELOW) * road - 3 * rmse)
    # in the middle of the last row and of the first
    bottom, top = (model.along(0.0, (row - grid.centre_v) / grid.scale) for row in (height - 1, 0))
    nearest, farthest = model.disparity_along(bottom), model.disparity_along(top)
    _, slope, bend = model.alpha
    rise = model.aspect * abs(slope + 2 * bend * bottom)
    wide = width / grid.scale * rise / nearest if nearest > 0 else math.inf
    if wide < tuning.narrowest:
        yield f"the view is as narrow as that of a table: {wide:.1f} camera heights"
    filled = float(on_road.sum()) / max(1.0, float(valid.sum()))
    if filled < min(tuning.filled_by_horizon * horizon, tuning.most_filled):
        yield f"a camera that looks down so far sees more of a road than {100 * filled:.0f} % of the pixels"
    nearest = max(nearest, 1e-9)  # a road may end above the border: then nothing is said of what is ahead
    near = road * (1 / nearest)  # 1 at the lower border, 0 at the horizon
    at_reach = wide / tuning.reach
    bands = np.clip(near * _BANDS, 0, _BANDS - 1).astype(np.intp)
    in_lane, lower, on = (
        np.bincount(bands[those], minlength=_BANDS) for those in (lane, lane & below, lane & on_road)
    )
    # a plane ends where it has begun: a border, or an own bonnet, that is seen nearer is no end ahead
    begun = np.logical_or.accumulate((on > lower)[::-1])[::-1]
    # nor is it one between road and road: a puddle mirrors the sky, which is far below
    between = np.append(begun[1:], False) & (np.cumsum(on) > np.cumsum(lower))
    some = begun & ~between & (in_lane >= _FEW) & (np.arange(_BANDS) + 0.5 >= _BANDS / 2 * at_reach)
    if (lower[some] > tuning.most_below * in_lane[some]).any():
        yield "the plane ends near ahead, as a table does: what is seen there lies below it"
    ground = road > 0 if checked.usable is None else (road > 0) & checked.usable[::step, ::step]
    shown = near[ground & on_road]
    begin = quantile(shown, _NEAREST) if shown.size else 1.0  # a dashboard's front hides what is nearer
    farther = ground & (near < begin / 2)  # more than twice as far away
    few = on_road[farther].sum() < tuning.least_farther * max(1, shown.size)
    if few and farther.sum() > _ENOUGH * ground.sum():
        yield "the plane is seen near ahead alone, as a dashboard is"
    begins = max(at_reach, 2 * farthest / nearest)
    ahead = (near < begins) & (near > begins / 2)
    seen = valid & ahead
    # from a truck's height a road is narrow there, and its lane tells more than all that is beside it
    shares = [on_road[those].mean() for those in (seen, seen & lane) if those.any()]
    if seen.sum() > _ENOUGH * ahead.sum() and max(shares) < tuning.least_beyond:
        yield "the plane is closed off near ahead, as the floor of a room or a road behind a near car is"
