"""The interval of an angle: a jackknife over bands and columns of the road."""

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats, Grid, powers, solve_normal
from rollcli.estimator.road.model import Parabola, Reals, RoadModel
from rollcli.estimator.road.sample import quantile
from rollcli.estimator.road.surface import ROUNDS, Surface
from rollcli.estimator.tuning import IntervalTuning

# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom
_T975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)
_NORMAL = 1.96  # 97.5 % quantile of the normal distribution
_LAST_STEP = 65535  # of 16 bits, whose sort takes a fifth of the time of single precision
_LEAST_SPAN = 1e-30  # units; keeps a division finite
_THETA, _CAMBER = 3, 4  # columns of the design
# standard errors below which a camber is none: at 0 kerbs of matched pairs are up to 15 mm off, in place of 4
_SURE = 2.0
_FARTHEST = 0.02  # of the nearest disparity: farther pixels have no height


@dataclass(frozen=True)
class Jackknife:
    """How (a0, a1, a2, theta) change as a group of pixels is left out; normalised coordinates, radians.

    The camber is free: where the pixels do not determine it, the angle changes the more.

    Attributes
    ----------
    bands, columns : ndarray, shape (groups, 4)
        The change for each band along the road, and for each column across it: as weights follow.
    white : ndarray, shape (4, 4)
        The textbook covariance, for as many pixels as could be independent.
    freedom : tuple of float
        Degrees of freedom of theta's change over bands and over columns.
    uneven : float
        How far the road's patches lie over or under its parabola, root mean square, over the root of the
        view's width where it is nearest; both in camera heights.
    hidden : float
        By how much wider the view is where the lane's road is nearest than at the map's lower border,
        camera heights.
    bend : float
        By how much the camber that was fitted moves theta.
    camber : float or None
        Curvature across the road, 1/(camera height), as far as it is surely more than noise; None where the
        pixels tell less of it than what is known of roads.
    """

    bands: Floats
    columns: Floats
    white: Floats
    freedom: tuple[float, float]
    uneven: float
    hidden: float
    bend: float
    camber: float | None

    def noise(self, theta: float, tuning: IntervalTuning) -> float:
        """Return the half-width that noise and misfit make at a roll, radians, before `tuning.factor`.

        A matcher takes the disparity for constant within its block. The more a rolled road's disparity
        changes along the rows, the more that errs; these errors are smooth and do not show in the residuals.
        """
        turned = (self.bands[:, _THETA], self.columns[:, _THETA])
        by_groups = [
            float(np.interp(freedom, range(1, len(_T975) + 1), _T975)) * math.sqrt(float(thetas.dot(thetas)))
            for thetas, freedom in zip(turned, self.freedom, strict=True)
        ]
        white = _NORMAL * math.sqrt(max(0.0, self.white[_THETA, _THETA]))
        return (1 + tuning.slant * abs(math.sin(theta))) * math.hypot(*by_groups, tuning.white * white)


@dataclass(frozen=True)
class Interval:
    """The 95 % interval of the roll, radians.

    Attributes
    ----------
    noise : float
        The part of the half-width that noise and misfit make.
    half_width : float
        The whole of it. At most a right angle: there are no other rolls.
    """

    noise: float
    half_width: float


def interval_of(
    jackknife: Jackknife, theta: float, turned: float, tuning: IntervalTuning, turns: float = 1.0
) -> Interval:
    """Return the 95 % interval of the roll angle.

    Parameters
    ----------
    jackknife : Jackknife
    theta : float
        Radians.
    turned : float
        Standard deviation of an error that all pixels share, radians: by which the map itself is turned, and
        the solver stopped beside the minimum.
    tuning : IntervalTuning
    turns : float
        See `rig_turns`: what the ground's own angles differ by turns the rig, and the map by so much less.
    """
    noise, bend = tuning.factor * jackknife.noise(theta, tuning), tuning.bend * jackknife.bend
    uneven, hidden = tuning.uneven * jackknife.uneven / turns, tuning.twist * jackknife.hidden / turns
    half_width = math.hypot(noise, uneven, bend, hidden, _NORMAL * turned)
    return Interval(min(noise, math.pi / 2), min(half_width, math.pi / 2))


def jackknife(surface: Surface, theta: float, tuning: IntervalTuning) -> Jackknife:
    """Leave out one group of the road's pixels after the other [Jackknife], and measure its unevenness.

    Parameters
    ----------
    surface : Surface
        The road's pixels and their weights.
    theta : float
        The roll that was estimated from them, radians.
    tuning : IntervalTuning

    Returns
    -------
    Jackknife
    """
    model = surface.model._replace(theta=theta)
    # in single precision, which takes a third less time: the angle itself does not come from here
    across, along = model.turned(np.array([surface.x, surface.y], np.float32))
    plain = model.disparity_along(along)
    nearest = float(plain.max())
    cambered = math.isfinite(surface.camber_precision)
    prior = surface.camber_precision if cambered else 0.0
    rows = _design(surface, model, across, along, plain)
    heights = rows[5] / np.maximum(plain, _FARTHEST * nearest)
    rows *= np.sqrt(surface.weights.astype(np.float32))  # from here on all products are weighted

    leverage = np.square(rows[3])
    bands, in_bands = _by_group(rows, along, None, tuning.groups)
    columns, in_columns = _by_group(rows, across, leverage, tuning.groups)
    quarter = in_bands * (2 * tuning.groups) + in_columns
    uneven = _unevenness(heights, leverage, quarter, tuning.groups, tuning.noise_falls)
    side = model.side(model.lateral(across, along), plain)
    in_lane = _nearest_seen(plain[np.abs(side) < 1], 0.5 / tuning.groups) or nearest
    width_at_1, border = _view(surface, model)

    total = bands.sum(0)
    inverse, whole, changes, bulge = _solved(total, np.concatenate([bands, columns]), prior)
    again, grown = inverse @ (rows[:5] * surface.yields @ rows[:5].T), np.eye(5)
    for _ in range(ROUNDS):  # what moves the road moves the weights, and these the road in the next round
        grown = np.eye(5) + again @ grown
    weight, rest = float(total[0, 0]), max(0.0, float(total[5, 5] - whole.dot(total[:5, 5])))
    # the variance of a pixel, times how many repeat each other
    variance = rest / weight * max(1.0, weight / tuning.independent_pixels)
    white: Floats = variance * grown @ inverse @ grown.T
    moved = changes @ grown.T
    if not surface.parabolic:  # there is no a2 to err
        white[2] = white[:, 2] = 0
    prior_share = prior * float(inverse[_CAMBER, _CAMBER])
    return Jackknife(
        bands=moved[: tuning.groups, :_CAMBER],
        columns=moved[tuning.groups :, :_CAMBER],
        white=white[:4, :4],
        freedom=(_freedom(bands), _freedom(columns)),
        # turned so far, as by half a turn, the model may be seen nowhere: then nothing is known
        uneven=uneven / math.sqrt(width_at_1 / nearest) if nearest > 0 else math.inf,
        hidden=width_at_1 * (1 / in_lane - 1 / max(border, in_lane)),
        bend=abs(model.camber * float(bulge[_THETA])),
        camber=_camber(model, prior_share, changes[:, _CAMBER]) if cambered else None,
    )


def _design(surface: Surface, model: RoadModel, across: Reals, along: Reals, plain: Reals) -> Reals:
    """Return the derivatives of the disparity by a0, a1, a2, theta and camber, and what is left: (6, N).

    `plain` has the disparities of the model at these coordinates, px.
    """
    rows = np.empty((6, len(along)), np.float32)
    rows[0], rows[1], rows[2] = 1, along, along * along * surface.parabolic
    model.turning(across, along, out=rows[3])
    cambered = math.isfinite(surface.camber_precision)
    rows[4] = model.bulge(model.lateral(across, along), plain) if cambered else 0
    rows[5] = surface.d - plain
    return rows


def _view(surface: Surface, model: RoadModel) -> tuple[float, float]:
    """Return how wide the view is across the road where its disparity is 1 px, camera heights.

    And the disparity, px, where the middle of the lane leaves what was looked at: a rolled view on one side.
    """
    cosine, sine = model.aspect * abs(math.cos(model.theta)), abs(math.sin(model.theta))
    grid, side = surface.grid, surface.sides[model.theta < 0]
    lateral = sum(surface.sides) * cosine + 2 * grid.centre_v / grid.scale * sine / model.aspect
    leaves = min(surface.lowest / max(model.aspect * cosine, _LEAST_SPAN), side / max(sine, _LEAST_SPAN))
    return lateral * abs(model.alpha[1]), model.disparity_along(leaves * (cosine**2 + sine**2))


def _nearest_seen(lane: Reals, share: float) -> float:
    """Return the disparity where the lane begins to be seen, px, by that which a `share` of it is beyond.

    An own bonnet is round: it hides the lane's nearest road, and not that beside it. The largest disparity
    does not tell, as single pixels of a bonnet match. A lane is as wide as its disparity is large, so that
    its area from the horizon on grows with the square. 0 where there is no lane.
    """
    return quantile(lane, 1 - share) / math.sqrt(1 - share) if lane.size else 0.0


def _unevenness(
    heights: Reals, leverage: Reals, quarter: NDArray[np.intp], groups: int, factor: float
) -> float:
    """Return the root mean square of the patches' mean heights, in the unit of `heights`.

    A patch is what a band and a column have in common, and counts as much as it turns the road; `quarter`
    (N,) says in which quarter of which patch each pixel is. Noise falls by `factor` from a quarter of a patch
    to the whole, an uneven road's heights hardly do: that tells them apart.
    """

    def sums_of(values: Reals) -> Floats:
        sums = np.bincount(quarter, values, 4 * groups**2)
        return np.asarray(sums, np.float64).reshape(groups, 2, groups, 2)

    def squares(sums: Floats, totals: Floats) -> float:
        return float((np.square(sums) / np.maximum(totals, _LEAST_SPAN)).sum())

    sums, totals = sums_of(leverage * heights), sums_of(leverage)
    quarters = squares(sums, totals)
    patches = squares(sums.sum((1, 3)), totals.sum((1, 3)))
    uneven = (factor * patches - quarters) / (factor - 1)
    return math.sqrt(max(0.0, uneven) / max(float(leverage.sum()), _LEAST_SPAN))


def _by_group(
    rows: Reals, position: Reals, share: Reals | None, groups: int
) -> tuple[Floats, NDArray[np.intp]]:
    """Return the products (groups, 6, 6) of groups of pixels, and in which half group (N,) each pixel is.

    The groups have equal total `share`, or number, and are cut along `position`. Of the six rows five are the
    design's; with the sixth, the residuals, a product is a group's normal equations, right-hand side
    included.
    """
    order, halves = _order(position), 2 * groups
    if share is None:
        cuts = [math.ceil(len(order) * half / halves) - 1 for half in range(1, halves)]
    else:
        heights = share.take(order).cumsum()
        cuts = heights.searchsorted(heights[-1] * np.arange(1, halves) / halves).tolist()
    half = np.empty(len(order), np.intp)
    half[order] = np.repeat(np.arange(halves), np.diff([0, *cuts, len(order)]))
    ordered = rows.take(order, 1, mode="clip")
    columns = ordered.copy().T  # BLAS takes twice as long for the product of an array with itself
    products = np.empty((groups, 6, 6), np.float32)
    for product, (start, end) in zip(products, itertools.pairwise([0, *cuts[1::2], len(order)]), strict=True):
        np.dot(ordered[:, start:end], columns[start:end], out=product)
    return products.astype(np.float64), half


def _order(position: Reals) -> NDArray[np.intp]:
    """Return what sorts pixels along a position, to a step of its span."""
    first, last = float(position.min()), float(position.max())
    steps = (position - first) * (_LAST_STEP / max(last - first, _LEAST_SPAN))
    return steps.astype(np.uint16).argsort(kind="stable")


def _solved(total: Floats, groups: Floats, prior: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Solve the normal equations (a0, a1, a2, theta, camber) of all pixels, and of all but a group.

    Returns
    -------
    inverse : ndarray, shape (5, 5)
        Of the normal matrix of all pixels.
    whole : ndarray, shape (5,)
        From the surface's parabola to the best one.
    changes : ndarray, shape (groups, 5)
        How they change as one group after the other is left out.
    bulge : ndarray, shape (4,)
        What a camber of 1 adds to the others, where it is not known.
    """
    normal, pull = total[:5, :5].copy(), total[:5, 5]
    bulge = solve_normal(normal[:_CAMBER, :_CAMBER], normal[:_CAMBER, _CAMBER])
    normal[_CAMBER, _CAMBER] += prior
    inverse = solve_normal(normal, np.eye(5))
    whole = inverse @ pull
    changes = whole - solve_normal(normal - groups[:, :5, :5], pull - groups[:, :5, 5])
    return inverse, whole, changes, bulge


def _camber(model: RoadModel, prior_share: float, changes: Floats) -> float | None:
    """Return the camber that the pixels alone ask for; None where the prior knows more than they.

    The square of what noise may make of it, as its `changes` by group show, is taken from its own: heights
    draw the camber of the lane out to the pavements.
    """
    if prior_share >= 0.5:
        return None
    noise = _SURE**2 * float(changes.dot(changes)) / max(model.camber**2, _LEAST_SPAN)
    return model.camber / (1 - prior_share) * max(0.0, 1 - noise) + 0.0  # no zero has a sign


def _freedom(groups: Floats) -> float:
    """Return the degrees of freedom of theta's change, by the groups' shares of its leverage [Freedom].

    1 / sum share^2 is the number of equal groups that would tell as much; one goes to the mean.
    """
    leverage = groups[:, _THETA, _THETA].tolist()
    return max(1.0, float(sum(leverage) ** 2 / sum(each * each for each in leverage)) - 1)


_MOST_MOVED = 0.05  # of the slope: no road bends more, so what does is no bend of the road


@dataclass(frozen=True)
class Tangent:
    """A line d = disparity + slope (y - row), y = v cos(theta) - u sin(theta), that touches the road.

    Attributes
    ----------
    theta : float
        Roll, radians.
    row : float
        The y where it touches, px from the centre of the top-left pixel: the mean of the pixels used.
    disparity, slope : float
        px, and px per px.
    jackknife : Jackknife or None
        Of the pixels used; None where the map is too small for one.
    grid : Grid
        The coordinates that it is in.
    """

    theta: float
    row: float
    disparity: float
    slope: float
    jackknife: Jackknife | None = field(default=None, repr=False, compare=False)
    grid: Grid = field(default=Grid(0.0, 0.0, 1.0), repr=False, compare=False)

    @property
    def changes(self) -> Floats | None:
        """Independent errors of (disparity, slope, theta), px and radians, (N, 3): their squares add up.

        None where the map is too small to tell. They are made anew each time: few estimates need them.
        """
        if self.jackknife is None:
            return None
        knife, grid = self.jackknife, self.grid
        # the groups' errors of (a0, a1, a2, theta), and the textbook's as half-widths
        errors = np.concatenate([knife.bands, knife.columns, _NORMAL * _roots(knife.white)])
        e0, e1, e2, turned = errors.T
        # there the roll turns the map about its centre, here about the top-left pixel
        flat = RoadModel(self.theta, (0.0, 0.0, 0.0))
        row, across = (of(grid.centre_u, grid.centre_v) for of in (flat.along, flat.across))
        centre = (self.row - row) / grid.scale
        disparity = e0 + centre * (e1 + centre * e2) + self.slope * across * turned
        return np.stack([disparity, (e1 + 2 * centre * e2) / grid.scale, turned], axis=1)

    def turned_by(self, slope: float) -> float:
        """Return by how much a slope along the rows, px per px, turns this road, radians."""
        return abs(math.cos(self.theta) * slope / self.slope) if self.slope else 0.0


def touch(
    alpha: Parabola, theta: float, grid: Grid, surface: Surface | None, jackknife: Jackknife | None
) -> Tangent:
    """Take the tangent of a road's parabola at the mean row of its pixels.

    Parameters
    ----------
    alpha : tuple of float
        The parabola, px.
    theta : float
        Roll, radians.
    grid : Grid
        Of the map; its centre is the point of contact where `surface` is None.
    surface : Surface or None
        The pixels used.
    jackknife : Jackknife or None
        Their jackknife.

    Returns
    -------
    Tangent
    """
    road, centre, cubic = RoadModel(theta, alpha), 0.0, (0.0, 0.0)
    if surface is not None:
        grid = surface.grid
        along = road.along(surface.x, surface.y)
        centre = float(surface.weights.dot(along)) / float(surface.weights.sum())
        # value and slope at the point of contact of the parabola that fits a cube
        rows = powers(along - centre, 3)
        weighted = rows[:3] * surface.weights
        value, moved, _ = solve_normal(weighted @ rows[:3].T, weighted @ rows[3]).tolist()
        cubic = value * grid.scale**3, moved * grid.scale**2  # px^3 and px^2
    row = centre * grid.scale + road.along(grid.centre_u, grid.centre_v)
    _, a1, a2 = alpha
    disparity, slope = road.disparity_along(row), a1 + 2 * a2 * row
    third = _third_power(disparity, slope, a2, cubic[1])
    disparity, slope = disparity - third * cubic[0], slope - third * cubic[1]
    return Tangent(theta, row, disparity, slope, jackknife, grid)


def _third_power(disparity: float, slope: float, bend: float, moved: float) -> float:
    """Return the coefficient of the cube that a road of constant curvature adds to its parabola, 1/px^2.

    A road of constant vertical curvature is y = h' d + s + c / d: the third derivative of d is 6 c d'^4 / d^4
    where the second one is -2 c d'^3 / d^3. A fitted parabola takes a part of the cube for slope, `moved` for
    a coefficient of 1: up to 0.6 % of the height on a road with a radius of 1 km.
    """
    if disparity <= 0 or slope <= 0:
        return 0.0
    third = -bend * slope / disparity
    most = _MOST_MOVED * slope / max(abs(moved), 1e-300)
    return max(-most, min(most, third))


def _roots(covariance: Floats) -> Floats:
    """Return independent errors, shape (4, 4), whose squares add up to a covariance."""
    sizes = np.sqrt(np.maximum(covariance.diagonal(), 0))
    shares, ways = np.linalg.eigh(covariance / np.maximum(np.outer(sizes, sizes), 1e-300))
    return np.asarray((ways * np.sqrt(np.maximum(shares, 0))).T * sizes)
