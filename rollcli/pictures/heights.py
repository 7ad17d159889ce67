"""Heights over the road: what is left of a map once the fitted road is taken away.

A pixel of disparity d sees a point; the road is a surface g of disparities: parabola, roll and camber. The
road's point of the same disparity and the same place across lies straight below that point in the rolled
camera, `gap` pixels further down, near the foot of the perpendicular; on hills and dips the road that the
pixel's own ray meets may lie far behind. The plane that touches the road there is, in disparities (see
`rollcli.rig.pose`),

    g + doffs = fx B q (X, Y, Z) / Z,   |q| = 1 / its distance from the camera,

so that the point's distance from it is (1 - (g + doffs) / (d + doffs)) / |q| = rise gap / ((d + doffs) |q|),
with the plane's rise per pixel along the road. For a flat road this is H (1 - g / d), exactly. On a road of
curvature k the foot lies h tan(pitch) from where the plane touches, which leaves k (h tan(pitch))^2 / 2: at a
curvature of 0.01 1/m and a pitch of 10 degrees 0.4 mm for a point 1.5 m above the road.

A road of constant curvature k is no parabola of disparities: its row is c0 + c1 d + c2 / d, with c2 = -k fx
fy B / 2. So the lane's profile is fitted once more, by how far its rows are off the parabola.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollcli.errors import UsageError
from rollcli.estimator.estimate import RollEstimate
from rollcli.estimator.moments import Bools, Floats, Singles, from_infinity, has_disparity, map_of, strips
from rollcli.estimator.road.model import FARTHEST_SIDE, Coordinate, RoadModel, column_ahead
from rollcli.estimator.road.sample import medians_of
from rollcli.files.results import Row
from rollcli.rig.calibration import Calibration, require_calibration

_BLOCK = 1 << 16  # pixels at a time: what they need stays in the processor's cache
_FLATTEST = 0.2  # of the rise near ahead: a parabola that is flatter is no road, which then goes on straight
_STEADIED = 5  # pixels: the side of what a median is of, that of the default block of matching
# of the lane's profile
_HALF_LANE = 0.8  # camera heights to each side: of a lane's width dips and cars leave most
_FAR = 8.0  # times as far as at the bottom: beyond, what the parabola leaves is kept as it is there
_OVER = 0.14  # of that range, nearer than the bottom's middle: the corners of rolled maps
_BINS = 32  # in equal steps of log d
_LEAST_BINS = 12  # that are needed
_SAMPLED = 125, 125  # rows and columns: twice as many move no height by 0.1 mm
# how far off the profile the road may be, camera heights at twice the bottom's distance and before, beyond it
# in proportion: at first what a parabola leaves on the steepest hills, then half of a kerb
_TOLERANCES = 0.12, 0.02
_LEAST_SPREAD = 0.02  # px along the road
_ROUNDS = 4  # of a fit, with each kind of weights
_STEPS = 4096  # of the table of a profile, up to the bottom's disparity
METRES, CAMERA_HEIGHTS = "metres", "camera heights"


@dataclass(frozen=True)
class FittedRoad:
    """The road of a map as it was fitted.

    Attributes
    ----------
    model : RoadModel
        In pixels of the map, from the centre of the top-left one.
    width, height : int
        Of the map, px.
    ahead : float or None
        Column of the middle row that looks straight ahead, where camber is level, px; None: the middle.
    """

    model: RoadModel
    width: int
    height: int
    ahead: float | None = None

    @classmethod
    def of_estimate(cls, estimate: RollEstimate) -> "FittedRoad":
        """Take the road of an estimate, with or without a pose."""
        # theta of the pixels, which is not the rig's where fx and fy differ
        knife, grid = estimate.tangent.jackknife, estimate.tangent.grid
        camber = None if knife is None else knife.camber
        model = RoadModel(estimate.tangent.theta, estimate.alpha, camber or 0.0, grid.aspect)
        return cls(model, estimate.width, estimate.height, grid.centre_u)

    @classmethod
    def of_row(cls, row: Row, calibration: Calibration | None) -> "FittedRoad | None":
        """Take the road of a row of a result; None where the row has none.

        Roll and camber of a row with a pitch are the rig's: the pitch turns the camber back into that of the
        view, and where fx and fy differ `calibration` the roll into that of the pixels, where the row has
        that of the rig alone.
        """
        if row.map_roll_deg is None or row.width is None or row.height is None or row.alpha is None:
            return None
        theta, pitch = math.radians(row.map_roll_deg), math.radians(row.pitch_deg or 0.0)
        ahead, aspect = None, 1.0
        if calibration is not None and row.pitch_deg is not None:
            aspect = calibration.aspect
            if row.image_roll_deg is None:
                theta = math.atan2(math.sin(theta) * aspect, math.cos(theta))
            ahead = column_ahead(theta, (calibration.cx, calibration.cy), (row.height - 1) / 2, aspect)
        model = RoadModel(theta, row.alpha, (row.camber or 0.0) / math.cos(pitch) ** 2, aspect)
        return cls(model, row.width, row.height, ahead)

    @property
    def middle(self) -> tuple[float, float]:
        """The middle column and row; the column is the one that looks straight ahead."""
        return (self.width - 1) / 2 if self.ahead is None else self.ahead, (self.height - 1) / 2

    def lateral(self, columns: Coordinate, rows: Coordinate) -> Coordinate:
        """Return the place beside the lane of pixels, px from the map's middle; see `RoadModel.lateral`."""
        column, row = self.middle
        x, y = columns - column, rows - row
        return self.model.lateral(self.model.across(x, y), self.model.along(x, y))

    @property
    def middle_rise(self) -> float:
        """The rise in the map's middle, px per px: it is the unit of camber."""
        _, a1, a2 = self.model.alpha
        return abs(a1 + 2 * a2 * self.model.along(*self.middle))


def unit_of(calibration: Calibration | None) -> str:
    """Return the unit of heights: metres where the calibration has a baseline, else camera heights."""
    return CAMERA_HEIGHTS if calibration is None or calibration.baseline is None else METRES


@np.errstate(all="ignore")
def height_map(
    disparity: ArrayLike, estimate: RollEstimate, calibration: Calibration | None = None
) -> Singles:
    """Return how high each pixel of a map lies over the road that was fitted to it.

    Parameters
    ----------
    disparity : array_like, shape (H, W)
        Real numbers, px; <= 0, NaN, what is beyond 1e15 and what a masked array hides are no data.
    estimate : RollEstimate
        Of this map, or of one in which the rig stood as it does here.
    calibration : Calibration, optional
        Of the rectified left view, at the map's size or at another one.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Along the road's normal, over the fitted road with roll and camber; positive: above it. Along the lane
        what the parabola leaves of a hill is fitted to this map. Metres, or without a calibration that has a
        baseline, camera heights: of the camera over the road at twice the distance of the nearest road that
        the map's middle shows. NaN where there is no disparity, and everywhere where the estimate's disparity
        does not grow downward: that is no road.

    Raises
    ------
    UsageError
        The map is no array of real numbers of the estimate's size, this is no estimate, or the calibration is
        of another view.

    Examples
    --------
    A level road 1.5 m below a rig of f = 200 px and B = 0.5 m, and a box of 30 cm on it:

    >>> import numpy as np
    >>> import rollcli
    >>> rig = rollcli.Calibration(fx=200, fy=200, cx=79.5, cy=29.5, baseline=0.5)
    >>> v = np.mgrid[:120, :160][0]
    >>> road = np.maximum(0.5 / 1.5 * (v - 29.5), 0)
    >>> estimate = rollcli.estimate_roll(road)
    >>> road[80:90, 60:100] = 0.5 / 1.2 * (v[80:90, 60:100] - 29.5)
    >>> bool(np.allclose(rollcli.height_map(road, estimate, rig)[80:90, 60:100], 0.3, atol=1e-3))
    True
    """
    values = map_of(disparity)
    if not isinstance(estimate, RollEstimate):
        kind = type(estimate).__name__
        raise UsageError(f"what is of type {kind} is no estimate: give what rollcli.estimate_roll returned")
    require_calibration(calibration)
    return heights_over(values, FittedRoad.of_estimate(estimate), calibration)


def heights_over(disparity: NDArray[Any], road: FittedRoad, calibration: Calibration | None) -> Singles:
    """Return the heights of a map over a road; see `height_map`."""
    size = road.height, road.width
    if disparity.shape != size or disparity.dtype.kind not in "fiu":
        raise UsageError(
            f"a disparity map of this road is real and of shape {size}, not of shape {disparity.shape} and "
            f"{disparity.dtype}"
        )
    heights = np.full(disparity.shape, np.nan, np.float32)
    if calibration is not None:
        calibration = calibration.for_size(road.width, road.height)
        a0, a1, a2 = road.model.alpha
        model = road.model._replace(alpha=(a0 + calibration.doffs, a1, a2))
        disparity, road = from_infinity(disparity, calibration.doffs), replace(road, model=model)
    profile = _Profile.of(road)
    if profile is None:
        return heights
    measured = calibration if unit_of(calibration) == METRES else None
    profile = profile.along(disparity)
    columns = np.arange(road.width, dtype=np.float32)
    for some in strips(road.height, _BLOCK // road.width):
        rows = np.arange(some.start, some.stop, dtype=np.float32)
        heights[some] = profile.heights(disparity[some], columns, rows[:, None], measured)
    return heights


def steadied(heights: Singles) -> Singles:
    """Return the medians of 5x5 pixels of a map of heights, where all of them have one.

    For heights of matched pairs: semi-global matching draws disparities towards whole pixels, on a road in
    bands of a few rows. Over the road their median is level where that of disparities would not be, and the
    edge of a kerb stays where it is. On rendered pairs errors of 3.6 mm at 10 m become 3.3 mm, where most of
    the road is matched along its plane and has no bands.
    """
    known = np.isfinite(heights)
    medians = cv2.medianBlur(np.where(known, heights, np.float32(0)), _STEADIED)
    whole = cv2.erode(known.astype(np.uint8), np.ones((_STEADIED, _STEADIED), np.uint8))
    return np.where(whole != 0, medians, heights).astype(np.float32, copy=False)


@dataclass(frozen=True)
class _Profile:
    """The road along its middle, about a row near ahead: d = disparity + rise y + bend y^2, px.

    `further` is how many px further down the road has each disparity than that; `_STEPS` up to the bottom's.
    """

    road: FittedRoad
    row: float
    disparity: float
    rise: float
    bend: float
    further: Singles | None = None

    @classmethod
    def of(cls, road: FittedRoad) -> "_Profile | None":
        """Take the row where the road is twice as far as at the bottom; None where there is no such row.

        The bottom is half the map's height below its centre, along the road: the same on a rolled copy.
        """
        a0, a1, a2 = road.model.alpha
        centre = road.model.along(*road.middle)
        bottom = centre + (road.height - 1) / 2
        half = road.model.disparity_along(bottom) / 2
        square = a1 * a1 + 4 * a2 * (half - a0)
        if not (half > 0 and square > 0 and a1 + 2 * a2 * bottom > 0):
            return None
        rise = math.sqrt(square)
        # of the two rows with that disparity the one on the rising branch, in a form that bears a2 = 0
        c0, c1 = road.model.disparity_along(centre), a1 + 2 * a2 * centre
        row = centre + (2 * (half - c0) / (c1 + rise) if c1 > 0 else (rise - c1) / (2 * a2))
        return cls(road, row, half, rise, a2)

    def along(self, disparity: NDArray[Any]) -> "_Profile":
        """Fit what the parabola leaves of the lane's profile in a map.

        In bins of distance it is the median across the lane, which dips, kerbs and cars do not move. Through
        these goes 1, d, 1/d, d^2 with Tukey's weights: that is a hill, and too stiff for a dip.
        """
        d, side, gap = self._sampled(disparity)
        bottom = 2 * self.disparity
        share = 1 - np.log(bottom / d) / math.log(_FAR)
        near = (np.abs(side) < _HALF_LANE) & (share > 0) & (share < 1 + _OVER)
        d, gap = d[near], gap[near]
        place = (share[near] * (_BINS / (1 + _OVER))).astype(np.uint16)
        middles = _FAR ** ((np.arange(_BINS) + 0.5) * ((1 + _OVER) / _BINS) - 1)  # of the bins, in bottoms
        scaled = np.maximum(1, 1 / (2 * middles)) * middles * (bottom / self.rise)
        design = _profile_basis(middles)
        weights: Floats = np.zeros(_BINS)
        fitted, left = np.zeros(4), gap
        for tolerance in _TOLERANCES:
            close = np.abs(left) < (tolerance * scaled)[place]
            medians = np.array(medians_of(place[close], left[close], _BINS))
            found = np.isfinite(medians)
            if np.count_nonzero(found) < _LEAST_BINS:
                return self
            more, weights = _steady_fit(design, np.nan_to_num(medians), found)
            fitted = fitted + more
            left = gap - (design @ fitted)[place]
        (used,) = np.nonzero(weights > 0)
        steps = np.arange(math.ceil(middles[used[-1]] * _STEPS) + 1) + 0.5
        kept = np.clip(steps / _STEPS, middles[used[0]], middles[used[-1]])
        return replace(self, further=(_profile_basis(kept) @ -fitted).astype(np.float32))

    def _sampled(self, disparity: NDArray[Any]) -> tuple[Singles, Singles, Singles]:
        """Return disparity, place across in camera heights and px above the parabola of some pixels."""
        down, right = (max(1, side // few) for side, few in zip(disparity.shape, _SAMPLED, strict=True))
        some = disparity[::down, ::right]
        rows = np.arange(0, self.road.height, down, dtype=np.float32)[:, None]
        columns = np.arange(0, self.road.width, right, dtype=np.float32)
        heights = self.heights(some, columns, rows, None)
        known = np.isfinite(heights)
        d = some[known].astype(np.float32)
        side = self.road.lateral(columns, rows)[known] * np.float32(self.road.middle_rise) / d
        return d, side, heights[known] * d / np.float32(self.rise)

    def at(self, disparity: Singles) -> tuple[Singles, Singles]:
        """Return the rows, px from this one, where the road has these disparities, and its rise there."""
        over = disparity - np.float32(self.disparity)
        bent = over
        if self.bend:  # beyond the end the parabola is flatter than any road, which goes on straight
            end = np.float32((_FLATTEST**2 - 1) * self.rise**2 / (4 * self.bend))
            bent = np.maximum(over, end) if self.bend > 0 else np.minimum(over, end)
        rise = np.sqrt(bent * np.float32(4 * self.bend) + np.float32(self.rise**2))
        foot = bent / ((rise + np.float32(self.rise)) * np.float32(0.5))
        foot += (over - bent) / rise
        if self.further is not None:
            steps = disparity * np.float32(_STEPS / (2 * self.disparity))
            steps = np.minimum(steps, np.float32(len(self.further) - 1))
            foot += self.further.take(steps.astype(np.intp))
        return foot, rise

    def heights(
        self, stored: NDArray[Any], columns: Singles, rows: Singles, calibration: Calibration | None
    ) -> Singles:
        """Return the heights of the pixels of columns (W,) and rows (H, 1), shape (H, W).

        The calibration has a baseline; None: heights are in camera heights.
        """
        road = self.road
        cosine, sine, camber = math.cos(road.model.theta), math.sin(road.model.theta), road.model.camber
        with np.errstate(over="ignore"):  # what becomes inf is no data
            d = stored.astype(np.float32)
        known = has_disparity(d)
        d[~known] = self.disparity
        lateral = road.lateral(columns, rows)
        side, rest, root = _cambered(d, lateral, road)
        foot, rise = self.at(d * rest)
        rise *= root
        gap = foot + columns * np.float32(sine) - (rows * np.float32(cosine) - np.float32(self.row))
        if calibration is None:
            return np.where(known, gap * np.float32(self.rise) / d, np.float32(np.nan))
        # |q| of the planes that touch the road, by their rise, 1/m
        aspect = calibration.aspect
        along = calibration.cy * cosine - calibration.cx * sine - self.row
        ahead = d * rest / rise - foot + np.float32(along)
        tilt = side / rise * np.float32(camber * road.middle_rise)
        ahead += tilt * (np.float32(road.lateral(calibration.cx, calibration.cy)) - lateral)
        lean = np.square(tilt * np.float32(road.model.aspect * cosine) - np.float32(sine))
        lean += np.square(tilt * np.float32(aspect * sine / road.model.aspect) + np.float32(aspect * cosine))
        ahead *= np.float32(1 / calibration.fx)
        length = np.sqrt(ahead * ahead + lean) * np.float32(1 / (calibration.baseline or 1.0))
        return np.where(known, gap / (length * d), np.float32(np.nan))


def _profile_basis(x: NDArray[Any]) -> NDArray[Any]:
    """Return 1, x, 1/x, x^2 of disparities, shape (N, 4)."""
    return np.stack([np.ones_like(x), x, 1 / x, x * x], axis=1)


def _steady_fit(design: Floats, values: Floats, found: Bools) -> tuple[NDArray[Any], NDArray[Any]]:
    """Fit values by Tukey's weights, six spreads wide; return those, too.

    They begin with what the values are, and with what least absolute deviations leave of them, which a hill
    needs and which bend to a kerb where it alone lies nearer than the bottom. Of both fits that of the least
    spread is taken.
    """
    weights = found.astype(np.float64)
    for _ in range(_ROUNDS):
        _, off = _weighted_fit(design, values, weights)
        weights = found / np.maximum(off, _LEAST_SPREAD)
    fits = [_tukey_fit(design, values, found, start) for start in (np.abs(values), off)]
    return min(fits, key=lambda fit: fit[0])[1:]


def _tukey_fit(
    design: Floats, values: Floats, found: Bools, off: NDArray[Any]
) -> tuple[float, NDArray[Any], NDArray[Any]]:
    """Return the spread of a fit that begins with how far values are off, the fit, and its weights."""
    for _ in range(_ROUNDS):
        spread = max(1.4826 * float(np.median(off[found])), _LEAST_SPREAD)
        weights = found * np.square(np.maximum(1 - np.square(off / (6 * spread)), 0))
        fitted, off = _weighted_fit(design, values, weights)
    return spread, fitted, weights


def _weighted_fit(design: Floats, values: Floats, weights: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return a fit by least squares, and how far each value is off it."""
    normal = (design * weights[:, None]).T
    fitted = np.linalg.solve(normal @ design, normal @ values)
    return fitted, np.abs(values - design @ fitted)


def _cambered(d: Singles, lateral: Singles, road: FittedRoad) -> tuple[Singles, Singles, Singles]:
    """Take from disparities what camber adds, which is of the disparity without it [RoadModel].

    Returns
    -------
    tuple of ndarray
        Places to the side in camera heights, of the disparity with camber, 0 beyond where camber is
        extrapolated; the share of the disparity that is not camber's; and what makes of the rise of the road
        without camber, by that share, its rise with it.
    """
    side = lateral * np.float32(road.middle_rise) / d
    # camber is not extrapolated beyond `FARTHEST_SIDE`, which is of the disparity without it
    most = np.float32(FARTHEST_SIDE / max(1 + road.model.camber / 2 * FARTHEST_SIDE**2, _FLATTEST))
    inside = np.clip(side, -most, most)
    root = np.maximum(inside * inside * np.float32(-2 * road.model.camber) + 1, np.float32(_FLATTEST**2))
    root = np.sqrt(root, out=root)
    rest, beyond = root * np.float32(0.5) + np.float32(0.5), inside != side
    inside[beyond], root[beyond] = 0, 1
    return inside, rest, root
