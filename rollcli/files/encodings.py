"""Stored numbers to pixels of disparity and back."""

import math
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, UsageError, about
from rollcli.estimator.moments import LARGEST
from rollcli.files.formats import Stored, read_stored
from rollcli.rig.calibration import Calibration, require_calibration


class Encoding(str, Enum):
    """How a stored number stands for a disparity in pixels."""

    PX = "px"  # as it is
    KITTI = "kitti"  # p / 256; 0 is no data
    CITYSCAPES = "cityscapes"  # (p - 1) / 256; 0 and 1 are no data
    SGBM = "sgbm"  # p / 16
    FOUNDATIONSTEREO = "foundationstereo"  # (R * 255^2 + G * 255 + B) / 1000 of an RGB PNG; 0 is no data
    DEPTH = "depth"  # a distance z: focal length * baseline / z - doffs


KITTI_TOP = 65534 / 256  # px: the largest disparity of a KITTI PNG; 65535 is never one
_SCALE = {
    Encoding.PX: 1.0,
    Encoding.KITTI: 1 / 256,
    Encoding.CITYSCAPES: 1 / 256,
    Encoding.SGBM: 1 / 16,
    Encoding.FOUNDATIONSTEREO: 1 / 1000,
}
_METRES = {"f": 1.0, "i": 1e-3, "u": 1e-3}  # a stored depth, by its kind: metres, or whole millimetres
_AUTO = {np.dtype(np.uint16): Encoding.KITTI, np.dtype(np.int16): Encoding.SGBM}
_WHOLE_PIXELS_BELOW = 512
HEIGHTS = "height over the road"  # begins what a file of heights says of its numbers


@dataclass(frozen=True)
class DisparityMap:
    """A map in pixels, and how it came about.

    Attributes
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; float32, or float64 where the file holds float64. No data is exactly 0; no NaN, no inf.
    encoding : Encoding
        The one used.
    warnings : dict of str to str
        Why the encoding taken by "auto" cannot be right, and what else a user should know; by their codes.
    """

    disparity: NDArray[Any]
    encoding: Encoding
    warnings: dict[str, str]


def to_disparity(
    stored: Stored,
    *,
    encoding: str = "auto",
    scale: float | None = None,
    invalid: Iterable[float] = (),
    calibration: Calibration | None = None,
) -> DisparityMap:
    """Turn stored numbers into pixels of disparity.

    Parameters
    ----------
    stored : Stored
        What a file holds.
    encoding : {"auto", "px", "kitti", "cityscapes", "sgbm", "foundationstereo", "depth"}
        auto: uint16 is kitti, int16 is sgbm, everything else px. depth: metres, in whole numbers millimetres.
    scale : float, optional
        Pixels (of a depth: metres) per stored unit, in place of the encoding's own; makes "auto" take px.
        Negative where the numbers are stored negative: no data are then NaN, inf and >= 0.
    invalid : iterable of float
        Stored values that mean no data, besides NaN, inf, <= 0, the file's own tag, the largest number of 16
        bits, and a constant plateau at either end of the range (`PlateauTuning`).
    calibration : Calibration, optional
        What turns a depth into a disparity; without one that has a baseline, that of a depth z is 1/z.

    Raises
    ------
    InputError
        These are heights that rollcli wrote.
    UsageError
        Unknown encoding, a scale of 0, a negative one for unsigned numbers, or a calibration of another view.
    """
    if stored.text.startswith(HEIGHTS):
        raise InputError("holds heights over the road: give the disparity map that they were measured in")
    used = resolve_encoding(encoding, stored.values.dtype, scale)
    factor = scale
    if factor is None:
        factor = _METRES[stored.values.dtype.kind] if used is Encoding.DEPTH else _SCALE[used]
    if not math.isfinite(factor) or factor == 0:
        raise UsageError(f"scale {factor}: must be a number other than 0, pixels per stored unit")
    if factor < 0 and stored.values.dtype.kind == "u":
        raise UsageError(f"scale {factor}: the stored numbers have no sign ({stored.values.dtype})")
    with np.errstate(all="ignore"):  # numbers too large for float32 become inf, and inf no data
        positive = stored.values
        if factor < 0:  # as reals: whole numbers have no room for what their lowest becomes
            positive = np.negative(positive, dtype=_real(positive))
        if used is Encoding.DEPTH:
            disparity = _from_depth(positive, abs(factor), calibration)
        else:
            disparity = _scaled(positive, used, abs(factor))
        for value in (*invalid, *stored.nodata, *_saturated(stored.values)):
            if math.isfinite(value):  # the others are no data already
                disparity[stored.values == value] = 0
    plateau = _without_plateaus(disparity, "1/m" if used is Encoding.DEPTH and calibration is None else "px")
    doubt = _doubt(stored.values, used) if encoding == "auto" and scale is None else ""
    warnings = {"pages": stored.note, "encoding": doubt, "plateau": plateau}
    told = {code: warning for code, warning in warnings.items() if warning}
    return DisparityMap(disparity, used, told)


def read_disparity(
    path: str | os.PathLike[str],
    *,
    encoding: str = "auto",
    scale: float | None = None,
    invalid: float | None = None,
    calibration: Calibration | None = None,
) -> NDArray[Any]:
    """Read a disparity map.

    Parameters
    ----------
    path : str or path
        A PNG, TIFF, NPY, NPZ, PFM or EXR file.
    encoding : {"auto", "px", "kitti", "cityscapes", "sgbm", "depth", "foundationstereo"}
        auto: uint16 is kitti, int16 is sgbm, everything else px. depth: metres, in whole numbers millimetres.
    scale : float, optional
        Pixels (of a depth: metres) per stored unit, in place of the encoding's own; makes "auto" take px.
        Negative where maps are stored negative.
    invalid : float, optional
        A stored value that means no data, besides NaN, inf, <= 0, the largest number of 16 bits, what the
        file itself marks, and a number at an end of the range that stands at many times as many pixels as the
        one beside it.
    calibration : Calibration, optional
        What turns a depth into a disparity; without one that has a baseline, that of a depth z is 1/z.

    Returns
    -------
    ndarray of float32, or of float64 if the file holds that, shape (H, W)
        Pixels; no data is 0.

    Raises
    ------
    InputError
        The file cannot be read, or is no map.
    UsageError
        Unknown encoding, a scale of 0, a negative one for unsigned numbers, or a calibration of another view.

    Examples
    --------
    >>> import os, tempfile
    >>> path = os.path.join(tempfile.mkdtemp(), "map.npy")
    >>> np.save(path, np.array([[0, 256, 640]], np.uint16))
    >>> read_disparity(path)  # unsigned 16 bits are read as KITTI's: 256 to a pixel, 0 is no data
    array([[0. , 1. , 2.5]], dtype=float32)
    """
    values = () if invalid is None else (invalid,)
    require_calibration(calibration)
    stored = read_stored(os.fspath(path), rgb=encoding == Encoding.FOUNDATIONSTEREO)
    with about(os.fspath(path)):
        found = to_disparity(stored, encoding=encoding, scale=scale, invalid=values, calibration=calibration)
    return found.disparity


def to_kitti(disparity: NDArray[Any]) -> NDArray[np.uint16]:
    """Turn pixels of disparity into the numbers of a KITTI PNG; no data and what exceeds `KITTI_TOP` is 0.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data. The smallest are rounded up: none of them becomes no data.
    """
    fits = (disparity > 0) & (disparity <= KITTI_TOP)
    numbers = np.rint(np.where(fits, disparity, 0).astype(np.float64) / _SCALE[Encoding.KITTI])
    stored: NDArray[np.uint16] = np.where(fits, np.maximum(numbers, 1), 0).astype(np.uint16)
    return stored


def resolve_encoding(encoding: str, dtype: np.dtype[Any], scale: float | None) -> Encoding:
    """Find the encoding that a name stands for, "auto" included."""
    if encoding == "auto":
        return Encoding.PX if scale is not None else _AUTO.get(dtype, Encoding.PX)
    try:
        return Encoding(encoding)
    except ValueError:
        names = ", ".join(("auto", *(each.value for each in Encoding)))
        raise UsageError(f"encoding {encoding!r} is unknown: choose one of {names}") from None


def _real(values: NDArray[Any]) -> type[np.floating[Any]]:
    """Return the type of the pixels that stored numbers become."""
    return np.float64 if values.dtype.kind == "f" and values.dtype.itemsize >= 8 else np.float32


def _scaled(values: NDArray[Any], encoding: Encoding, scale: float) -> NDArray[Any]:
    """Pixels; whatever is not a positive finite number becomes 0."""
    real = _real(values)
    if values.dtype.kind == "u" and encoding is not Encoding.CITYSCAPES and scale < LARGEST:
        product: NDArray[Any] = np.multiply(values, real(scale), dtype=real)  # one pass: the usual case
        return product
    pixels: NDArray[Any] = np.fmax(values, 0).astype(real)  # fmax: NaN gives way to 0
    if encoding is Encoding.CITYSCAPES:
        pixels = np.fmax(pixels - real(1), real(0))
    pixels *= real(scale)
    if not np.isfinite(pixels.max()):
        pixels[~np.isfinite(pixels)] = 0
    return pixels


def _from_depth(values: NDArray[Any], metres: float, calibration: Calibration | None) -> NDArray[Any]:
    """Turn stored depths into pixels of disparity; whatever is no depth becomes 0."""
    real = _real(values)
    depth: NDArray[Any] = np.multiply(values, real(metres), dtype=real)
    focal_baseline, doffs = 1.0, 0.0
    if calibration is not None and calibration.baseline is not None:
        rig = calibration.for_size(*reversed(values.shape))
        focal_baseline, doffs = rig.fx * calibration.baseline, rig.doffs
    pixels = real(focal_baseline) / depth - real(doffs)
    found: NDArray[Any] = np.where(np.isfinite(depth) & (depth > 0) & (pixels > 0), pixels, real(0))
    found[np.isinf(found)] = 0
    return found


def _saturated(values: NDArray[Any]) -> tuple[float, ...]:
    """Find the largest number of 16 bits, if the map holds it: it marks what was too large or unknown."""
    if values.dtype not in (np.uint16, np.int16) or (top := values.max()) < np.iinfo(values.dtype).max:
        return ()
    return (float(top),)


def _doubt(values: NDArray[Any], encoding: Encoding) -> str:
    """Say why the encoding that "auto" took cannot be right; empty when it can."""
    if encoding is Encoding.KITTI and 0 < (top := int(values.max())) < _WHOLE_PIXELS_BELOW:
        return (
            f"uint16 numbers up to {top}, read as kitti (/256), are disparities up to {top / 256:.2f} px: "
            "they look like whole pixels (--encoding px)"
        )
    return ""


@dataclass(frozen=True)
class PlateauTuning:
    """What makes a plateau of the first or the last number of a map.

    OpenCV writes the disparity before its range for what it did not match, which is a positive one where the
    range begins at 2 or later; a range that is too short, eight bits that overflow and a far end of depths
    pile up at the last number.

    Of 105 real maps of five matchers none has one: their ends hold 7 % of the pixels at most, and then 1.7
    times as many as the number beside it, for whole pixels are steps. OpenCV's mark fills 20 to 50 % of the
    maps that have it, the first disparity of its range 2 to 11 %, and each number beside that 0.2 %.

    Attributes
    ----------
    share : float
        Of the pixels with data; fewer do no harm.
    times : float
        As many as of the number beside it, or that as many as of the next one.
    edge : float
        Of `share`, in the second case: how many the number beside it must be.
    every : int
        Take each such row and column: enough for shares.
    least : int
        Pixels with data that tell shares, among those taken.
    """

    share: float = 0.05
    times: float = 4.0
    edge: float = 0.2
    every: int = 4
    least: int = 100


_PLATEAU = PlateauTuning()


def _without_plateaus(disparity: NDArray[Any], unit: str) -> str:
    """Set constant plateaus at the ends of the range to 0, which is no data, in place; say what was set.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        In the unit; 0 is no data.
    unit : str

    Returns
    -------
    str
        Empty where there is none.
    """
    few = disparity[:: _PLATEAU.every, :: _PLATEAU.every]
    few = few[few > 0]
    if few.size < _PLATEAU.least:
        return ""
    said = []
    for which, end in (("smallest", np.min), ("largest", np.max)):
        if found := _plateau(few, end):
            for value in found:
                disparity[disparity == value] = 0
            share, value = np.isin(few, found).mean(), f"{found[0]:g} {unit}"
            said.append(f"{share:.0%} of the disparities are the {which}, {value}: they are taken as no data")
    return "; ".join(said)


def _plateau(values: NDArray[Any], end: Callable[[NDArray[Any]], Any]) -> list[Any]:
    """Return what makes a plateau, from the end on: nothing, one number, or a mark and the range's edge."""
    least, ends, counts = _PLATEAU.share * values.size, list[Any](), list[int]()
    while len(ends) < 3 and values.size:
        ends.append(end(values))
        beyond = values != ends[-1]
        counts.append(values.size - int(np.count_nonzero(beyond)))
        if counts[0] < least:
            return []
        values = values[beyond]
    if len(ends) < 3:  # of a map of a few numbers, shares tell nothing
        return []
    of_one, of_two = (counts[place] > _PLATEAU.times * counts[place + 1] for place in (0, 1))
    return ends[:2] if of_two and counts[1] > _PLATEAU.edge * least else ends[:1] if of_one else []
