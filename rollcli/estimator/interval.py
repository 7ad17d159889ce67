"""How sure the angle is: a jackknife over the road's pixels, and how much its parts disagree.

Neighbouring disparities are not independent, and what a road's parabola misses is smooth: the textbook
standard error is far too small. Leaving out whole bands (along the road) and whole columns (across it) shows
how far both noise and misfit move the angle. On real roads most of the error is neither: the lane, the whole
road, its near and its far part have angles of their own, and how far these are apart tells how far the choice
matters. The interval assumes that the pixels used are road, and that the rig is calibrated.

[Jackknife]: Kott, "The delete-a-group jackknife", Journal of Official Statistics 17(4), 2001. [Freedom]:
Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bulletin 2(6),
1946.
"""

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.estimator.moments import Floats
from rollcli.estimator.normal import regular, unit
from rollcli.estimator.road.model import Reals, RoadModel
from rollcli.estimator.road.robust_fit import MOST_FADED
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.tuning import IntervalTuning

# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom
_T975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)
_NORMAL = 1.96  # 97.5 % quantile of the normal distribution
_LAST_STEP = 65535  # of 16 bits, whose sort takes a fifth of the time of single precision
_LEAST_SPAN = 1e-30  # units; keeps a division finite
_THETA, _CAMBER = 3, 4  # columns of the design


@dataclass(frozen=True)
class Jackknife:
    """How (a0, a1, a2, theta) change as a group of pixels is left out; normalised coordinates, radians.

    The camber is free: where the pixels do not determine it, the angle changes the more.

    Attributes
    ----------
    bands, columns : ndarray, shape (groups, 4)
        The change for each band along the road, and for each column across it.
    white : ndarray, shape (4, 4)
        The textbook covariance, for as many pixels as could be independent.
    freedom : tuple of float
        Degrees of freedom of theta's change over bands and over columns.
    lateral : float
        By how much the theta of the lane ahead differs from that of all pixels.
    depth : float
        By how much the theta of the near half differs from that of the far half.
    bend : float
        By how much the camber that was fitted moves theta.
    camber : float or None
        Curvature across the road, 1/(camera height); None where the pixels tell less of it than what is known
        of roads.
    """

    bands: Floats
    columns: Floats
    white: Floats
    freedom: tuple[float, float]
    lateral: float
    depth: float
    bend: float
    camber: float | None

    def spreads(self) -> tuple[float, float, float]:
        """Return the half-widths of theta's interval, radians: by bands, by columns, and the textbook's."""
        turned = (self.bands[:, _THETA], self.columns[:, _THETA])
        bands, columns = (
            _student(freedom) * math.sqrt(float(thetas.dot(thetas)))
            for thetas, freedom in zip(turned, self.freedom, strict=True)
        )
        return bands, columns, _NORMAL * math.sqrt(self.white[_THETA, _THETA])


@dataclass(frozen=True)
class Interval:
    """The 95 % interval of the roll, radians.

    Attributes
    ----------
    noise : float
        The part of the half-width that noise and misfit make.
    half_width : float
        All of it: with the part that the choice of surface makes.
    """

    noise: float
    half_width: float


def interval_of(jackknife: Jackknife, theta: float, turned: float, tuning: IntervalTuning) -> Interval:
    """Return the 95 % interval of the roll angle.

    Parameters
    ----------
    jackknife : Jackknife
    theta : float
        Radians.
    turned : float
        Standard deviation of an error that all pixels share, by which the map itself is turned, radians.
    tuning : IntervalTuning
    """
    noise = tuning.factor * noise_of(jackknife, theta, tuning)
    lateral, depth = tuning.lateral * jackknife.lateral, tuning.depth * jackknife.depth
    bend = tuning.bend * jackknife.bend
    return Interval(noise, math.sqrt(noise**2 + lateral**2 + depth**2 + bend**2 + (_NORMAL * turned) ** 2))


def noise_of(jackknife: Jackknife, theta: float, tuning: IntervalTuning) -> float:
    """Return the half-width that noise and misfit make at a roll, radians, before `tuning.factor`."""
    bands, columns, white = jackknife.spreads()
    return slant(theta, tuning) * math.hypot(bands, columns, tuning.white * white)


def slant(theta: float, tuning: IntervalTuning) -> float:
    """Return how much wider the interval is at a roll, radians: 1 at none, 2 at a right angle.

    A matcher takes the disparity for constant within its block. The more a rolled road's disparity changes
    along the rows, the more that errs; these errors are smooth and do not show in the residuals.
    """
    return 1 + tuning.slant * abs(math.sin(theta))


def jackknife(surface: Surface, theta: float, tuning: IntervalTuning) -> Jackknife:
    """Leave out one group of the road's pixels after the other [Jackknife], and compare its parts.

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
    weights = surface.weights.astype(np.float32)
    cambered = math.isfinite(surface.camber_precision)
    prior = surface.camber_precision if cambered else 0.0
    plain = model.disparity_along(along)
    rows = np.empty((6, len(along)), np.float32)
    rows[0], rows[1], rows[2] = 1, along, along * along * surface.parabolic
    model.turning(across, along, out=rows[3])
    rows[4] = model.bulge(across, plain) if cambered else 0
    rows[5] = surface.d - plain
    rows *= np.sqrt(weights)  # from here on all products are weighted

    bands = _by_group(rows, along, None, tuning.groups)
    columns = _by_group(rows, across, np.square(rows[3]), tuning.groups)
    total = bands.sum(0)
    parts = _lane(model.side(across, plain)), _near(weights, along, tuning)
    lane, near = ((rows * part).dot(rows.T) for part in parts)
    halves = [part + tuning.whole_share * total for part in (lane, total, near, total - near)]
    found = _solved(total, np.concatenate([bands, columns]), halves, prior)

    white: Floats = found.inverse * _white(total, found.whole, tuning)
    if not surface.parabolic:  # there is no a2 to err
        white[2] = white[:, 2] = 0
    of_lane, of_all, of_near, of_far = found.halves[:, _THETA].tolist()
    return Jackknife(
        bands=found.changes[: tuning.groups],
        columns=found.changes[tuning.groups :],
        white=white[:4, :4],
        freedom=(_freedom(bands), _freedom(columns)),
        lateral=abs(of_lane - of_all),
        depth=abs(of_near - of_far),
        bend=abs(model.camber * float(found.bulge[_THETA])),
        camber=_camber(model, prior * float(found.inverse[_CAMBER, _CAMBER])) if cambered else None,
    )


def _lane(side: Reals) -> Reals:
    """Return how much each pixel belongs to the lane ahead, 0 to 1."""
    lane: Reals = np.exp(-np.minimum(np.square(np.square(side)), MOST_FADED))
    return lane


def _near(weights: Reals, along: Reals, tuning: IntervalTuning) -> Reals:
    """Return how much each pixel belongs to the near half, 0 to 1."""
    middle = float(weights.dot(along)) / float(weights.sum())
    near: Reals = 1 / (1 + np.exp(np.minimum((middle - along) / tuning.depth_fade, MOST_FADED)))
    return near


def _by_group(rows: Reals, position: Reals, share: Reals | None, groups: int) -> Floats:
    """Return the products (groups, 6, 6) of groups of equal total `share`, or number, cut along `position`.

    Of the six rows five are the design's; with the sixth, the residuals, a product is a group's normal
    equations, right-hand side included.
    """
    order = _order(position)
    if share is None:
        cuts = [math.ceil(len(order) * group / groups) - 1 for group in range(1, groups)]
    else:
        heights = share.take(order).cumsum()
        cuts = heights.searchsorted(heights[-1] * np.arange(1, groups) / groups).tolist()
    ordered = rows.take(order, 1, mode="clip")
    columns = ordered.copy().T  # BLAS takes twice as long for the product of an array with itself
    products = np.empty((groups, 6, 6), np.float32)
    for product, (start, end) in zip(products, itertools.pairwise([0, *cuts, len(order)]), strict=True):
        np.dot(ordered[:, start:end], columns[start:end], out=product)
    return products.astype(np.float64)


def _order(position: Reals) -> NDArray[np.intp]:
    """Return what sorts pixels along a position, to a step of its span."""
    first, last = float(position.min()), float(position.max())
    steps = (position - first) * (_LAST_STEP / max(last - first, _LEAST_SPAN))
    return steps.astype(np.uint16).argsort(kind="stable")


class _Solutions(NamedTuple):
    """Solutions (a0, a1, a2, theta, camber) of normal equations.

    Attributes
    ----------
    inverse : ndarray, shape (5, 5)
        Of the normal matrix of all pixels.
    whole : ndarray, shape (5,)
        From the surface's parabola to the best one.
    changes : ndarray, shape (groups, 4)
        How the first four change as one group after the other is left out.
    halves : ndarray, shape (4, 5)
        Of parts, at the fitted camber.
    bulge : ndarray, shape (5,)
        What a camber of 1 adds to the others, where it is not known.
    """

    inverse: Floats
    whole: Floats
    changes: Floats
    halves: Floats
    bulge: Floats


def _solved(total: Floats, groups: Floats, halves: list[Floats], prior: float) -> _Solutions:
    """Solve the normal equations of all pixels, of all but a group, and of parts. At once takes less time."""
    free = 6 + len(groups)  # of these the camber is free
    products = np.empty((free + len(halves) + 1, 6, 6))
    products[:6] = products[-1] = total
    np.subtract(total, groups, out=products[6:free])
    products[free:-1] = halves
    normal, pulls = products[:, :5, :5], products[:, :5, 5:]
    pulls[:5, :, 0] = unit(5)  # whose solutions are the inverse
    pulls[-1] = normal[-1, :, _CAMBER:]
    pulls[-1, _CAMBER] = 0
    normal[:free, _CAMBER, _CAMBER] += prior
    normal[free:, _CAMBER] = normal[free:, :, _CAMBER] = 0
    solutions: Floats = np.asarray(np.linalg.solve(regular(normal, normal[0]), pulls)[..., 0], np.float64)
    inverse, whole = solutions[:5], solutions[5]
    changes = (whole - solutions[6:free])[:, :4]
    return _Solutions(inverse, whole, changes, solutions[free:-1], solutions[-1])


def _white(total: Floats, whole: Floats, tuning: IntervalTuning) -> float:
    """Return the variance of a pixel, times how many repeat each other, px^2."""
    independent = max(1.0, float(total[0, 0]) / tuning.independent_pixels)
    rest = max(0.0, float(total[5, 5] - whole.dot(total[:5, 5])))
    return rest / float(total[0, 0]) * independent


def _camber(model: RoadModel, prior_share: float) -> float | None:
    """Return the camber that the pixels alone ask for; None where the prior knows more than they."""
    return model.camber / (1 - prior_share) if prior_share < 0.5 else None


def _freedom(groups: Floats) -> float:
    """Return the degrees of freedom of theta's change, by the groups' shares of its leverage [Freedom].

    1 / sum share^2 is the number of equal groups that would tell as much; one goes to the mean.
    """
    leverage = groups[:, _THETA, _THETA].tolist()
    return max(1.0, float(sum(leverage) ** 2 / sum(each * each for each in leverage)) - 1)


def _student(freedom: float) -> float:
    """Return the 97.5 % quantile of Student's t, between whole degrees of freedom by interpolation."""
    below = min(int(freedom), len(_T975) - 1)
    part = min(freedom, len(_T975)) - below
    return _T975[below - 1] + part * (_T975[below] - _T975[below - 1])
