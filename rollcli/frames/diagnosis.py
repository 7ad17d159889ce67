"""What a file that is no disparity map in pixels seems to be, and what to do about it.

Of 108 real maps none is taken for anything else, stretched to 8 bits or not. Of the depth maps made of them
105 are told, a third as depth or upside down; of the maps turned upside down 107, a tenth likewise. Each of
86 real photographs is told; blurred and dark ones are not.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError, InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import Encoding
from rollcli.files.formats import Stored
from rollcli.frames.options import FrameOptions

# share of the disparities beyond the map's width: from here on these are not outliers, but the whole map
_BEYOND = 0.01
# the nearest of a real map lie at up to a quarter of its width; one that is still larger is no better
_PLAUSIBLE = 0.5
_DIVISORS = (("sgbm", 16), ("kitti", 256))
# Neighbours in a row, in 256 levels. Of photographs 57 to 83 % differ by more than a level, and 6 to 24 % are
# equal; of maps at most 31 %, and at least 38 %. Noise differs by more than a quarter of the range
_TEXTURED, _EQUAL, _NOISE_STEP, _NOISE = 0.45, 0.3, 64, 0.1
# rows whose median grows downward are those of a disparity map: no need to try what else it may be. The
# correlation of row and median is -0.95 to 0.0 in depth maps and in maps that are upside down
_DOWNWARD = 0.2
_EVERY = 4  # rows, and columns where these need not be neighbours: enough for shares and medians
_WIDE = math.radians(5.0)  # how wide an interval may be where only the road counts
_DEPTH_MAP = "like a depth map: give --encoding depth and its calibration, such as --calib FILE"
_UPSIDE_DOWN = "upside down: reverse the order of its rows"


def require_positive(stored: Stored, name: str) -> None:
    """Refuse a map of nothing but negative numbers; a single one, repeated, is a mark for no data.

    Raises
    ------
    InputError
    """
    values = stored.values
    if values.dtype.kind not in "if" or values.max() > 0 or np.any(values > 0):  # the maximum may be NaN
        return
    negative = values[values < 0]
    negative = negative[np.isfinite(negative)]
    if negative.size and negative.min() < (top := negative.max()):
        raise InputError(
            f"{name}: every number is negative, {negative.min():g} to {top:g}: is the map stored with the "
            "other sign? Negate its numbers"
        )


def too_large(disparity: NDArray[Any], stored: Stored, encoding: str) -> str:
    """Say that the disparities cannot be pixels, and what would divide them; empty when they can.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    stored : Stored
        What the file holds.
    encoding : str
        How it was read.
    """
    width = disparity.shape[1]
    if not disparity.max() > width:
        return ""
    valid = disparity[disparity > 0]
    share = np.count_nonzero(valid > width) / valid.size
    if share < _BEYOND:
        return ""
    said = (
        f"{share:.0%} of the disparities are larger than the map is wide, {width} px "
        f"(up to {valid.max():.0f})"
    )
    if encoding == Encoding.DEPTH:
        return f"{said}: give --scale, the metres that a stored number of 1 stands for"
    numbers = stored.values[disparity > 0]
    near = float(np.quantile(numbers.astype(np.float64), 1 - _BEYOND))
    fitting = [(name, by) for name, by in _DIVISORS if name != encoding and near / by <= _PLAUSIBLE * width]
    if not fitting:
        return f"{said}: give --scale, the pixels that a stored number of 1 stands for"
    times = " or ".join(str(by) for _, by in fitting)
    remedy = " or ".join(f"--encoding {name} (stored / {by})" for name, by in fitting)
    return f"{said}: the numbers look {times} times too large; give {remedy}"


def looks_like(disparity: NDArray[Any], stored: Stored | None, options: FrameOptions) -> str:
    """Say what a map without a sure angle looks like instead; empty when it looks like nothing known.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    stored : Stored or None
        What the file holds; None for a map that was matched from a pair.
    options : FrameOptions
    """
    return "" if stored is None else next(_likenesses(disparity, stored, options), "")


def _likenesses(disparity: NDArray[Any], stored: Stored, options: FrameOptions) -> Iterator[str]:
    if _is_photograph(stored.values):
        yield "looks like a photograph, not a disparity map: give photographs by --left and --right"
    if _grows_downward(disparity):
        return
    depth = options.encoding.encoding != Encoding.DEPTH and _has_road(_inverse(disparity), options)
    reversed_rows = _has_road(disparity[::-1], options)
    if depth and reversed_rows:  # few roads tell which
        yield f"looks {_DEPTH_MAP}; or it is {_UPSIDE_DOWN}"
    elif depth:
        yield f"looks {_DEPTH_MAP}"
    elif reversed_rows:
        yield f"looks {_UPSIDE_DOWN}"


def _is_photograph(values: NDArray[Any]) -> bool:
    """Tell whether whole numbers have the texture of a photograph; `_TEXTURED` says how maps differ."""
    if values.dtype.kind != "u" or values.shape[1] < 2:
        return False
    levels = values[::_EVERY].astype(np.int64)
    top = int(levels.max())
    if top > 255:
        levels = levels * 255 // top
    steps = np.abs(np.diff(levels, axis=1))
    return bool(
        np.mean(steps > 1) > _TEXTURED
        and np.mean(steps == 0) < _EQUAL
        and np.mean(steps > _NOISE_STEP) < _NOISE
    )


def _grows_downward(disparity: NDArray[Any]) -> bool:
    """Tell whether the lower a row lies, the larger its disparities are, as in a map with a road."""
    rows = [(v, row[(row > 0) & np.isfinite(row)]) for v, row in enumerate(disparity[::_EVERY, ::_EVERY])]
    medians = np.array([(v, np.median(valid)) for v, valid in rows if valid.size])
    if len(medians) < 3 or not np.ptp(medians[:, 1]) > 0:
        return False
    return bool(np.corrcoef(medians.T)[0, 1] > _DOWNWARD)


def _inverse(values: NDArray[Any]) -> NDArray[Any]:
    valid = values > 0
    return np.where(valid, 1 / np.where(valid, values, 1), 0)


def _has_road(disparity: NDArray[Any], options: FrameOptions) -> bool:
    """Tell whether a road is found that gives no reason for doubt, however wide its interval."""
    seed = options.method.seed
    try:
        return estimate_roll(disparity, max_interval=_WIDE, seed=seed).status == "ok"
    except EstimationError:
        return False
