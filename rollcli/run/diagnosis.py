"""What a file that is no disparity map in pixels seems to be, and what to do about it.

Of 105 real maps none is taken for anything else, stretched to 8 bits or not. Of depth maps made of them 104
and more are told, and so is each of the maps turned upside down and of 86 real photographs; of blurred and
dark ones few are. The numbers lie amid the gaps that these files leave
(python tests/benchmarks/bench_diagnosis.py).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError, InputError
from rollcli.estimator import tuning as estimator
from rollcli.estimator.estimate import RollEstimate, estimate_roll
from rollcli.estimator.request import DEFAULT_REQUEST, Request
from rollcli.files.encodings import Encoding
from rollcli.files.formats import Stored
from rollcli.run.options import FramesOptions

_DIVISORS = (("sgbm", 16), ("kitti", 256))
# what to do about what is no map in pixels: at the command line, and in Python
REMEDIES = {
    "depth": (
        "give --encoding depth and its calibration, such as --calib FILE",
        "give focal length times baseline, over the depth",
    ),
    "photograph": ("give photographs by --left and --right", "give both views to rollcli.estimate_pair"),
    "encoding": ("--encoding {name} (stored / {by})", "the numbers / {by}"),
    "scale": ("--scale, the pixels that a stored number of 1 stands for", "pixels"),
    "sign": ("give --scale -1", "give the numbers with the other sign"),
    "metres": ("--scale, the metres that a stored number of 1 stands for", "metres"),
}
# rows alone would mirror what a camera saw that hung, and its roll would have the other sign
_UPSIDE_DOWN = "upside down: reverse the order of its rows; if the camera hung, that of its columns, too"
_HUNG = "looks upside down, as from a rig that hung: turn both views by half a turn, and swap them"


@dataclass(frozen=True)
class DiagnosisTuning:
    """The numbers that tell what a file looks like; what they were found on stands above.

    Attributes
    ----------
    beyond : float
        Share of the disparities that are larger than the map is wide: from here on they are not outliers.
    plausible : float
        Share of the map's width up to which its nearest disparities may reach; in real maps a quarter. A
        divisor that leaves them larger does not explain the map.
    textured, equal : float
        Shares of the neighbours in a row, in 256 levels. In photographs 57 to 83 % differ by more than a
        level and 6 to 24 % are equal; in maps at most 31 %, and at least 38 %.
    noise_step, noise : float
        A step of levels, and the share of steps beyond it that noise has and no photograph.
    downward : float
        Correlation of a row and the median of its disparities from which a map has its near parts below:
        no need to try what else it may be. In depth maps and in maps that are upside down -0.95 to 0.0.
    marks : int
        As many negative numbers may stand for no data.
    every : int
        Take each such row, and column where these need not be neighbours: enough for shares and medians.
    wide : float
        How wide an interval may be where only the road counts, radians.
    """

    beyond: float = 0.01
    plausible: float = 0.5
    textured: float = 0.45
    equal: float = 0.3
    noise_step: int = 64
    noise: float = 0.1
    downward: float = 0.2
    marks: int = 16
    every: int = 4
    wide: float = math.radians(5.0)


TUNING = DiagnosisTuning()

# a road whose near and far parts, or whose lanes, have different rolls is a road
_ANY_ANGLE = replace(
    estimator.TUNING,
    doubts=replace(estimator.TUNING.doubts, rival_share=math.inf, longest_move=math.inf, noise_share=1.0),
)


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
            "other sign? Give --scale -1"
        )


def not_pixels(disparity: NDArray[Any], stored: Stored, encoding: str, *, python: bool = False) -> str:
    """Say that the disparities cannot be pixels, and what would scale them; empty when they can.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    stored : Stored
        What the file holds.
    encoding : str
        How it was read.
    python : bool
        Whether the words are for a caller in Python.
    """
    width, largest = disparity.shape[1], disparity.max()
    scale = REMEDIES["metres" if encoding == Encoding.DEPTH else "scale"][python]
    if 0 < largest < 1:  # a matcher tells none of these from another; such are depths in mm, and shares
        return f"no disparity reaches 1 px, the largest is {largest:.2g}: give {scale}"
    if not largest > width:
        return ""
    valid = disparity[disparity > 0]
    share = np.count_nonzero(valid > width) / valid.size
    if share < TUNING.beyond:
        return ""
    said = (
        f"{share:.0%} of the disparities are larger than the map is wide, {width} px "
        f"(up to {valid.max():.0f})"
    )
    if encoding == Encoding.DEPTH:
        return f"{said}: give {scale}"
    numbers = stored.values[disparity > 0]
    near = float(np.quantile(numbers.astype(np.float64), 1 - TUNING.beyond))
    fitting = [
        (name, by) for name, by in _DIVISORS if name != encoding and near / by <= TUNING.plausible * width
    ]
    if not fitting:
        return f"{said}: give {scale}"
    times = " or ".join(str(by) for _, by in fitting)
    remedy = " or ".join(REMEDIES["encoding"][python].format(name=name, by=by) for name, by in fitting)
    return f"{said}: the numbers look {times} times too large; give {remedy}"


def looks_like(
    disparity: NDArray[Any], stored: Stored | None, options: FramesOptions, *, python: bool = False
) -> str:
    """Say what a map without a sure angle looks like instead; empty when it looks like nothing known.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    stored : Stored or None
        What the file holds; None for a map that was matched from a pair.
    options : FramesOptions
    python : bool
        Whether the words are for a caller in Python.
    """
    if stored is not None and _is_photograph(stored.values):
        return f"looks like a photograph, not a disparity map: {REMEDIES['photograph'][python]}"
    if stored is not None and (options.encoding.scale or 1) > 0 and _is_negative(stored.values):
        return f"most numbers are negative, as if stored with the other sign: {REMEDIES['sign'][python]}"
    if _grows_downward(disparity):
        return ""
    if stored is None:
        return _HUNG if _has_road(disparity[::-1, ::-1], options) else ""
    depth = options.encoding.encoding != Encoding.DEPTH
    if depth:
        inverse = np.divide(1, disparity, out=np.zeros_like(disparity), where=disparity > 0)
        depth = _has_road(inverse, options)
    reversed_rows = _has_road(disparity[::-1], options)
    if depth:  # few roads tell which
        either = f"; or it is {_UPSIDE_DOWN}" if reversed_rows else ""
        return f"looks like a depth map: {REMEDIES['depth'][python]}{either}"
    return f"looks {_UPSIDE_DOWN}" if reversed_rows else ""


def estimate_or_liken(
    disparity: NDArray[Any], request: Request, likeness: Callable[[], str], **how: Any
) -> tuple[RollEstimate, str]:
    """Estimate the roll of a map; where there is no sure angle, say what the map looks like instead.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; 0 is no data.
    request : Request
    likeness : callable
        Says it, which takes a while; see `looks_like`.
    **how
        What else `estimate_roll` takes.

    Raises
    ------
    EstimationError
        The pixels do not determine an angle; it says what the map looks like, which is its code.
    """
    try:
        estimate = estimate_roll(disparity, request, **how)
    except EstimationError as error:
        found = likeness()
        raise EstimationError("; ".join(filter(None, [found, str(error)])), found) from error
    return estimate, likeness() if estimate.status != "ok" else ""


def _is_photograph(values: NDArray[Any]) -> bool:
    """Tell whether whole numbers have the texture of a photograph; `DiagnosisTuning` says how maps differ."""
    if values.dtype.kind != "u" or values.shape[1] < 2:
        return False
    levels = values[:: TUNING.every].astype(np.int64)
    top = int(levels.max())
    if top > 255:
        levels = levels * 255 // top
    steps = np.abs(np.diff(levels, axis=1))
    return bool(
        np.mean(steps > 1) > TUNING.textured
        and np.mean(steps == 0) < TUNING.equal
        and np.mean(steps > TUNING.noise_step) < TUNING.noise
    )


def _is_negative(values: NDArray[Any]) -> bool:
    """Tell whether most numbers are negative, and more of them than may be marks for no data."""
    few = values[:: TUNING.every, :: TUNING.every]
    negative = few[few < 0]
    return bool(negative.size > np.count_nonzero(few > 0) and np.unique(negative).size > TUNING.marks)


def _grows_downward(disparity: NDArray[Any]) -> bool:
    """Tell whether the lower a row lies, the larger its disparities are, as in a map with a road."""
    few = disparity[:: TUNING.every, :: TUNING.every]
    rows = [(v, row[(row > 0) & np.isfinite(row)]) for v, row in enumerate(few)]
    medians = np.array([(v, np.median(valid)) for v, valid in rows if valid.size])
    if len(medians) < 3 or not np.ptp(medians[:, 1]) > 0:
        return False
    return bool(np.corrcoef(medians.T)[0, 1] > TUNING.downward)


def _has_road(disparity: NDArray[Any], options: FramesOptions) -> bool:
    """Tell whether a road is found that gives no reason for doubt, however uncertain its angle is."""
    request = Request(max_interval=TUNING.wide, seed=options.method.seed, tuning=_ANY_ANGLE)
    return sure_estimate(disparity, request) is not None


def sure_estimate(disparity: NDArray[Any], request: Request = DEFAULT_REQUEST) -> RollEstimate | None:
    """Estimate the roll of a map, shape (H, W), px, 0 is no data; None unless the estimate is `ok`."""
    try:
        estimate = estimate_roll(disparity, request)
    except EstimationError:
        return None
    return estimate if estimate.status == "ok" else None
