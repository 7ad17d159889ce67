"""The energy of [GD] eq. 9, its gradient (eq. 12-13), its curvature and its parabola, from moments alone.

[GD]: Fan, Wang, Liu, Pitas, "A Robust Roll Angle Estimation Algorithm Based on Gradient Descent",
arXiv:1906.01894. [VarPro]: Golub, Pereyra, "The differentiation of pseudo-inverses and nonlinear least
squares problems whose variables separate", SIAM J. Numer. Anal. 10(2), 1973. README.md has the derivation.

With the origin at the centroid of the pixels, a map is the sum of its best plane and a residual r that is
orthogonal to 1, p and q. In the frame rotated by theta the plane is ``cx x + cy y``. `cy y` and the constant
belong to the road, so the parabola in y has to explain ``e = r + cx x``. What it leaves of `e` is small near
the minimum: no large numbers cancel, as they do in ``d'd - d'Y (Y'Y)^-1 Y'd``.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError
from rollcli.estimator.moments import Floats, Grid, Moments, to_powers_of_sum
from rollcli.estimator.road.model import Parabola

# x^i y^j of the rotated frame that the energy and its two derivatives need, as (i, j)
_OF_WEIGHTS = ((2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (2, 2), (1, 3), (0, 4))
_OF_RESIDUAL = ((2, 0), (1, 1), (0, 2))
SAME_EVERYWHERE = "the disparity is the same everywhere: every roll angle fits it equally well"
_SMALLEST, _LARGEST = 1e-120, 1e120  # px: a solver multiplies squares of what it is given
_SINGULAR = 1e-10  # a variance below this share of its square scale is rounding error


class Terms(NamedTuple):
    """The energy at an angle.

    Attributes
    ----------
    value : float
        E_min(theta), the weighted sum of squared residuals, px^2.
    gradient, curvature : float
        Its first and second derivative with respect to theta, px^2/rad and px^2/rad^2.
    """

    value: float
    gradient: float
    curvature: float


@dataclass(frozen=True)
class Energy:
    """E_min as a function of theta, with period pi. Make it with `Energy.of`.

    Attributes
    ----------
    weight : float
        The sum of the pixels' weights.
    peak : float
        The largest disparity used, px: the unit of the normalised energy.
    parabolic : bool
        Whether the road is a parabola in y or a line.
    grid : Grid
        Normalised coordinates with their origin at the centroid of the pixels.
    plane : tuple of float
        The pixels' best plane c0 + c1 p + c2 q on `grid`, px.
    rest : float
        Weighted sum of squared residuals of that plane, px^2.
    forms : ndarray, shape (13, 12)
        The rotated moments as polynomials in cos(theta) and sin(theta).
    """

    weight: float
    peak: float
    parabolic: bool
    grid: Grid
    plane: tuple[float, float, float]
    rest: float
    forms: Floats

    @classmethod
    def of(cls, moments: Moments, *, parabolic: bool = True) -> "Energy":
        """Reduce the moments of a map.

        Parameters
        ----------
        moments : Moments
        parabolic : bool
            The road model: d = a0 + a1 y + a2 y^2, or its first two terms.

        Raises
        ------
        EstimationError
            When the pixels do not determine a plane, or every angle fits them equally well.
        """
        n, peak = float(moments.s[0, 0]), moments.peak
        if n <= 0:
            raise EstimationError("no valid pixel: all are zero, negative, not finite or masked out")
        if not _SMALLEST < peak < _LARGEST:
            raise EstimationError(f"disparities up to {peak:g}: their squares leave double precision")
        p, q = float(moments.s[1, 0]) / n, float(moments.s[0, 1]) / n
        along_p, along_q = to_powers_of_sum(np.array([-p, -q]))
        s = along_p.dot(moments.s).dot(along_q.T).tolist()  # NumPy is slow on single numbers
        t = along_p[:3, :3].dot(moments.t).dot(along_q[:3, :3].T).tolist()
        spread = s[2][0] * s[0][2] - s[1][1] ** 2
        if spread <= _SINGULAR * (s[2][0] + s[0][2]) ** 2:
            raise EstimationError("the valid pixels lie on one line: they do not determine a roll angle")
        c0 = t[0][0] / n
        c1 = (s[0][2] * t[1][0] - s[1][1] * t[0][1]) / spread
        c2 = (s[2][0] * t[0][1] - s[1][1] * t[1][0]) / spread
        rest = max(0.0, float(moments.dd) - c0 * t[0][0] - c1 * t[1][0] - c2 * t[0][1])
        sources = [s[i][j] for i, j in _monomials(2)]
        residual = [t[i][j] - c0 * s[i][j] - c1 * s[i + 1][j] - c2 * s[i][j + 1] for i, j in _monomials(2)]
        higher = [s[i][j] for k in (3, 4) for i, j in _monomials(k)]
        grid = moments.grid
        centred = Grid(grid.centre_u + p * grid.scale, grid.centre_v + q * grid.scale, grid.scale)
        forms = _rotations().dot(sources + residual + higher)
        energy = cls(n, peak, parabolic, centred, (c0, c1, c2), rest, forms)
        if energy.slope_energy + max(map(abs, residual)) ** 2 / n <= 1e-18 * n * peak**2:
            raise EstimationError(SAME_EVERYWHERE)
        return energy

    @property
    def slope_energy(self) -> float:
        """What the best plane explains beyond its mean, px^2."""
        xx, xy, yy = self.forms[0, 0], self.forms[1, 0], self.forms[2, 0]
        _, c1, c2 = self.plane
        return float(c1 * c1 * xx + 2 * c1 * c2 * xy + c2 * c2 * yy)

    def at(self, theta: float) -> Terms:
        """Evaluate energy, gradient and curvature at an angle, radians."""
        rotated = self._in_frame(math.cos(theta), math.sin(theta))
        xx, xy, yy, xxx, xxy, xyy, yyy, xxyy, xyyy, yyyy, rxx, rxy, ryy, cx, cy = rotated
        n = self.weight
        skew, mean = yyy / yy, yy / n  # phi = y^2 - skew y - mean is orthogonal to 1 and y
        per_phi = self._inverse(yyyy - yyy * skew - yy * mean, yyyy)
        phi = ryy + cx * (xyy - skew * xy)
        b2 = phi * per_phi
        b1 = cx * xy / yy - skew * b2
        b0 = -mean * b2
        value = self.rest + cx * cx * (xx - xy * xy / yy) - phi * b2
        slope, bend = cy + b1, 2 * b2  # of the road's parabola, at the centroid
        res_x = cx * xx - b1 * xy - b2 * xyy
        res_xy = rxy + cx * xxy - b0 * xy - b1 * xyy - b2 * xyyy
        res_xx = rxx + cx * xxx - b0 * xx - b1 * xxy - b2 * xxyy
        gradient = 2 * (slope * res_x + bend * res_xy)
        # the coefficients follow theta: subtract what that saves [VarPro]
        z0 = bend * xy
        z1 = slope * xy + bend * xyy - res_x
        z2 = slope * xyy + bend * xyyy - 2 * res_xy
        saved = z0 * z0 / n + z1 * z1 / yy + (z2 - skew * z1 - mean * z0) ** 2 * per_phi
        moved = slope * slope * xx + 2 * slope * bend * xxy + bend * bend * xxyy
        return Terms(value, gradient, 2 * (moved - saved - bend * res_xx))

    def as_quotient(self, c: Floats, s: Floats) -> tuple[Floats, Floats]:
        """Return numerator and denominator of E_min less `rest`; the latter is det(Y'Y) / weight.

        Both are homogeneous polynomials of degree 6 in c and s, which are the cosine and the sine of theta
        times a factor: coordinates that are longer by a factor leave E_min as it is.
        """
        *rotated, cx, _ = self._in_frame(c, s)
        xx, xy, yy, _, _, xyy, yyy, _, _, yyyy, _, _, ryy = rotated
        cx = cx / (c * c + s * s)
        phi = ryy * yy + cx * (xyy * yy - yyy * xy)
        determinant = yy * yyyy - yyy * yyy - yy * yy * yy / self.weight
        return cx * cx * (xx - xy * xy / yy) * determinant - phi * phi / yy, determinant

    def parabola(self, theta: float) -> Parabola:
        """Return (a0, a1, a2) of the road d = a0 + a1 y + a2 y^2 at `theta`, in pixels.

        y = v cos(theta) - u sin(theta) is measured from the centre of the top-left pixel.

        Raises
        ------
        EstimationError
            When y takes only two values, so that the normal equations are singular.
        """
        rotated = self._in_frame(math.cos(theta), math.sin(theta))
        _, xy, yy, _, _, xyy, yyy, _, _, yyyy, _, _, ryy, cx, cy = rotated
        skew, mean = yyy / yy, yy / self.weight
        per_phi = self._inverse(yyyy - yyy * skew - yy * mean, yyyy)
        if self.parabolic and not per_phi > 0:
            raise EstimationError("the valid pixels lie on two lines: they do not determine a parabola")
        b2 = (ryy + cx * (xyy - skew * xy)) * per_phi
        slope = (cy + cx * xy / yy - skew * b2) / self.grid.scale
        bend = b2 / self.grid.scale**2
        level = self.plane[0] - mean * b2
        y = self.grid.centre_v * math.cos(theta) - self.grid.centre_u * math.sin(theta)
        return level - slope * y + bend * y * y, slope - 2 * bend * y, bend

    def rmse(self, value: float) -> float:
        """Root of the mean squared residual, px, where E_min has this value."""
        return math.sqrt(max(0.0, value) / self.weight)

    def _in_frame(self, c: Any, s: Any) -> list[Any]:
        """Return the moments in the frame x = c p + s q, y = c q - s p, then the plane's slopes along x, y.

        Each a number, for NumPy is slow on single ones, or an array shaped like c and s.
        """
        cc, cs, ss = c * c, c * s, s * s
        basis = [cc, cs, ss, cc * c, cc * s, c * ss, ss * s, cc * cc, cc * cs, cc * ss, cs * ss, ss * ss]
        rotated = self.forms.dot(basis)
        _, c1, c2 = self.plane
        return [*(rotated if rotated.ndim > 1 else rotated.tolist()), c1 * c + c2 * s, c2 * c - c1 * s]

    def _inverse(self, norm: float, scale: float) -> float:
        """Return 1 / norm, or 0, which drops the square: for a line, or where y has two values only."""
        return 1 / norm if self.parabolic and norm > _SINGULAR * scale else 0.0


def _monomials(degree: int) -> list[tuple[int, int]]:
    return [(degree - j, j) for j in range(degree + 1)]


@cache
def _rotations() -> NDArray[np.float64]:
    """Return the map from moments on the grid to `Energy.forms`, shape (13, 12, 15).

    x^i y^j = (c p + s q)^i (c q - s p)^j, expanded into c^a s^b times p^k q^l. Sources: the weights' moments
    of degree 2, the residual's of degree 2, the weights' of degree 3 and 4.
    """
    basis = [pair for degree in (2, 3, 4) for pair in _monomials(degree)]
    source = {("w", m): k for k, m in enumerate(_monomials(2))}
    source |= {("r", m): 3 + k for k, m in enumerate(_monomials(2))}
    source |= {("w", m): 6 + k for k, m in enumerate([*_monomials(3), *_monomials(4)])}
    rows = [("w", m) for m in _OF_WEIGHTS] + [("r", m) for m in _OF_RESIDUAL]
    tensor = np.zeros((len(rows), len(basis), len(source)))
    for row, (kind, (i, j)) in enumerate(rows):
        for k in range(i + 1):  # k factors p out of x, m factors q out of y
            for m in range(j + 1):
                sines = i - k + j - m
                power = (k + j - m, i - k + m)
                sign = (-1) ** (j - m)
                column = basis.index((i + j - sines, sines))
                tensor[row, column, source[kind, power]] += sign * math.comb(i, k) * math.comb(j, m)
    return tensor
