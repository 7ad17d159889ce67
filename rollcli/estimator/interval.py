"""How sure the angle is: a delete-a-group jackknife over bands and columns of the road.

Neighbouring disparities are not independent, and what a road's parabola misses is smooth: the textbook
standard error is far too small. Leaving out whole bands (along the road) and whole columns (across it) shows
how far both noise and misfit move the angle. The interval assumes that the pixels are road and that the road
is not cambered: neither shows in the residuals.

[Jackknife]: Kott, "The delete-a-group jackknife", Journal of Official Statistics 17(4), 2001. [Freedom]:
Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bulletin 2(6),
1946.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from rollcli.estimator.moments import Floats
from rollcli.estimator.road.model import Reals
from rollcli.estimator.road.robust_fit import solvable
from rollcli.estimator.road.surface import Surface
from rollcli.estimator.tuning import IntervalTuning

# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom
_T975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179)


@dataclass(frozen=True)
class Jackknife:
    """How (a0, a1, a2, theta) change as a group of pixels is left out; normalised coordinates, radians.

    Attributes
    ----------
    bands, columns : ndarray, shape (groups, 4)
        The change for each band along the road, and for each column across it.
    white : ndarray, shape (4, 4)
        The textbook covariance, for as many pixels as could be independent.
    freedom : tuple of float
        Degrees of freedom of theta's change over bands and over columns.
    """

    bands: Floats
    columns: Floats
    white: Floats
    freedom: tuple[float, float]

    def spreads(self) -> tuple[float, float, float]:
        """Return the half-widths of theta's interval, radians: by bands, by columns, and the textbook's."""
        bands, columns = (
            _student(freedom) * math.sqrt(float(np.square(changes[:, 3]).sum()))
            for changes, freedom in zip((self.bands, self.columns), self.freedom, strict=True)
        )
        return bands, columns, 1.96 * math.sqrt(self.white[3, 3])


def half_width(jackknife: Jackknife, theta: float, tuning: IntervalTuning) -> float:
    """Return the half-width of the 95 % interval of the roll angle, radians."""
    bands, columns, white = jackknife.spreads()
    return tuning.factor * slant(theta, tuning) * math.sqrt(bands**2 + columns**2 + white**2)


def slant(theta: float, tuning: IntervalTuning) -> float:
    """Return how much wider the interval is at a roll, radians: 1 at none, 2 at a right angle.

    A matcher takes the disparity for constant within its block. The more a rolled road's disparity changes
    along the rows, the more that errs; these errors are smooth and do not show in the residuals.
    """
    return 1 + tuning.slant * abs(math.sin(theta))


def jackknife(surface: Surface, theta: float, tuning: IntervalTuning) -> Jackknife:
    """Leave out one group of the road's pixels after the other [Jackknife].

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
    across, along = model.across(surface.x, surface.y), model.along(surface.x, surface.y)
    rows = np.empty((5, len(along)))
    rows[0], rows[1], rows[2] = 1, along, along * along * surface.parabolic
    rows[3] = model.turning(across, along)
    rows[4] = surface.d - model.disparity_along(along)
    bands = _by_group(rows, surface.weights, along, np.ones_like(along), tuning.groups)
    leverage = surface.weights * np.square(rows[3])
    columns = _by_group(rows, surface.weights, across, leverage, tuning.groups)
    total = bands.sum(0)
    normal = total[:4, :4]
    inverse = np.linalg.inv(solvable(normal))
    step = inverse @ total[:4, 4]  # from the surface's parabola to the best one
    independent = max(1.0, total[0, 0] / tuning.independent_pixels)
    rest = max(0.0, total[4, 4] - step @ total[:4, 4])
    white: Floats = inverse * (rest / total[0, 0] * independent)
    if not surface.parabolic:  # there is no a2 to err
        white[2] = white[:, 2] = 0
    return Jackknife(
        bands=_changes(bands, normal, step),
        columns=_changes(columns, normal, step),
        white=white,
        freedom=(_freedom(bands, normal), _freedom(columns, normal)),
    )


def _by_group(rows: Floats, weights: Floats, position: Reals, share: Floats, groups: int) -> Floats:
    """Return the weighted products (groups, 5, 5) of groups of equal total `share`, cut along `position`.

    Of the five rows four are the design's; with the fifth, the residuals, a product is a group's normal
    equations, right-hand side included.
    """
    order = np.argsort(position)
    heights = np.cumsum(share[order])
    cuts = np.searchsorted(heights, heights[-1] * np.arange(1, groups) / groups)
    bounds = [0, *cuts.tolist(), len(order)]
    sorted_rows = rows[:, order]
    weighted = sorted_rows * weights[order]
    return np.stack([weighted[:, a:b] @ sorted_rows[:, a:b].T for a, b in itertools.pairwise(bounds)])


def _changes(groups: Floats, normal: Floats, step: Floats) -> Floats:
    """Return how the four parameters change as one group after the other is left out, shape (groups, 4)."""
    parts, pulls = groups[:, :4, :4], groups[:, :4, 4]
    changes = np.linalg.solve(solvable(normal - parts), (pulls - parts @ step)[..., None])
    return np.asarray(changes[..., 0], np.float64)


def _freedom(groups: Floats, normal: Floats) -> float:
    """Return the degrees of freedom of theta's change, by the groups' shares of its leverage [Freedom].

    1 / sum share^2 is the number of equal groups that would tell as much; one goes to the mean.
    """
    leverage = groups[:, 3, 3] / normal[3, 3]
    return max(1.0, 1 / float(np.square(leverage).sum()) - 1)


def _student(freedom: float) -> float:
    """Return the 97.5 % quantile of Student's t, between whole degrees of freedom by interpolation."""
    return float(np.interp(freedom, np.arange(1, len(_T975) + 1), _T975))
