"""The road's disparity: a parabola in the rolled coordinate along the road [GD eq. 1-5], and camber.

[GD]: Fan, Wang, Liu, Pitas, "A Robust Roll Angle Estimation Algorithm Based on Gradient Descent",
arXiv:1906.01894.
"""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.floating[Any]]
Coordinate = TypeVar("Coordinate", float, Reals)
Parabola = tuple[float, float, float]
"""(a0, a1, a2) of d = a0 + a1 y + a2 y^2."""

_STEEPEST = 2.0  # columns a row: a rig that lies on its side sees the lane along the rows
_HARDLY = 1e-9  # of the slope: a disparity that is none, by which squares can be divided
FARTHEST_SIDE = 4.0  # camera heights to the side; camber is not extrapolated beyond


class RoadModel(NamedTuple):
    """A road d = a0 + a1 along + a2 along^2, rolled by theta, and what camber adds to it.

    Every method keeps the dtype of its arrays: single precision in, single precision out.

    Attributes
    ----------
    theta : float
        Roll, radians.
    alpha : tuple of float
        (a0, a1, a2), px per unit, unit squared of the coordinates x and y.
    camber : float
        Curvature across the road, 1/(camera height): it rises by camber/2 side^2. Negative: crowned.
    aspect : float
        fy / fx: theta and the coordinates are of the pixels, and what lies to the side is of the rig.
    """

    theta: float
    alpha: Parabola
    camber: float = 0.0
    aspect: float = 1.0

    @classmethod
    def of_plane(cls, c0: float, c1: float, c2: float, aspect: float = 1.0) -> "RoadModel":
        """Return the road that is the plane d = c0 + c1 x + c2 y."""
        return cls(math.atan2(-c1, c2), (c0, math.hypot(c1, c2), 0.0), 0.0, aspect)

    def across(self, x: Coordinate, y: Coordinate) -> Coordinate:
        """Return the coordinate across the road, x cos(theta) + y sin(theta)."""
        return x * math.cos(self.theta) + y * math.sin(self.theta)

    def along(self, x: Coordinate, y: Coordinate) -> Coordinate:
        """Return the coordinate along the road, y cos(theta) - x sin(theta)."""
        return y * math.cos(self.theta) - x * math.sin(self.theta)

    def lateral(self, across: Coordinate, along: Coordinate) -> Coordinate:
        """Return the coordinate to the side of the lane: `across` where pixels are square.

        Elsewhere it is aspect x cos(theta) + y sin(theta) / aspect: that of square pixels, times what the
        slope along the road is less by in these pixels.
        """
        if self.aspect == 1:
            return across
        c, s, aspect = math.cos(self.theta), math.sin(self.theta), self.aspect
        return across * (aspect * c * c + s * s / aspect) + along * (c * s * (1 / aspect - aspect))

    def turned(self, places: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return across and along, shape (2, N), of x and y, shape (2, N): several times faster."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return np.asarray(np.array([[c, s], [-s, c]], np.float32).dot(places))

    def disparity(self, x: Reals, y: Reals) -> Reals:
        """Return the road's disparity, px, camber included."""
        along = self.along(x, y)
        road = self.disparity_along(along)
        if self.camber == 0:
            return road
        return road + self.camber * self.bulge(self.lateral(self.across(x, y), along), road)

    def disparity_along(self, along: Coordinate) -> Coordinate:
        """Return the disparity, px, of the road without camber, where the coordinate along it is known."""
        a0, a1, a2 = self.alpha
        return a0 + along * (a1 + along * a2)

    def turning(self, across: Reals, along: Reals, out: Reals | None = None) -> Reals:
        """Return the derivative of the road's disparity with respect to theta, px/rad [GD eq. 13]."""
        _, a1, a2 = self.alpha
        slope = np.multiply(along, -2 * a2, out=out)
        slope -= a1
        slope *= across
        return slope

    def bulge(self, lateral: Reals, road: Reals) -> Reals:
        """Return what a camber of 1 adds to the disparity, px: half the disparity times the side squared.

        Parameters
        ----------
        lateral : ndarray
            See `lateral`.
        road : ndarray
            Disparity there without camber, px; hardly anything is returned where it is not positive.

        Notes
        -----
        A surface that is higher by h camera heights is nearer, and its disparity larger by the factor
        1 / (1 - h), in first order 1 + h.
        """
        positive = self._positive(road)
        bulge = lateral * abs(self.alpha[1])
        bulge *= bulge
        bulge /= positive
        np.minimum(bulge, positive * FARTHEST_SIDE**2, out=bulge)
        bulge *= 0.5
        return bulge

    def side(self, lateral: Reals, disparity: Reals) -> Reals:
        """Return how far to the right of the middle the road's pixels lie, in camera heights.

        Parameters
        ----------
        lateral : ndarray
            See `lateral`.
        disparity : ndarray
            Of the road there, px; above the horizon, where it is not positive, the result is very large.

        Notes
        -----
        A point X to the right at depth Z is seen at lateral = f X / Z with disparity d = f B / Z, and a flat
        road's slope is a1 = B / H, for baseline B and camera height H. So lateral a1 / d = X / H, whatever
        the focal length and the unit of the disparities.
        """
        side: Reals = lateral * abs(self.alpha[1])
        side /= self._positive(disparity)
        return side

    def _positive(self, disparity: Reals) -> Reals:
        """Return disparities, px, that one can divide by."""
        return np.asarray(np.maximum(disparity, _HARDLY * abs(self.alpha[1]) + 1e-30))


def column_ahead(theta: float, middle: tuple[float, float], row: float, aspect: float = 1.0) -> float:
    """Return the column of a row where the lane ahead is, px, in an image that is rolled by theta.

    The lane runs through the principal point `middle`, its column and row, at right angles to the horizon:
    where `RoadModel.lateral` is 0.
    """
    aside = math.tan(theta) / aspect**2
    return middle[0] + (middle[1] - row) * min(max(aside, -_STEEPEST), _STEEPEST)


def rig_turns(theta: float, aspect: float) -> float:
    """Return by how much more than an image the rig turns: tan(roll) = tan(theta) / aspect."""
    return aspect / (aspect**2 * math.cos(theta) ** 2 + math.sin(theta) ** 2)
