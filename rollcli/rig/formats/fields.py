"""What a calibration file says, and the steps that several formats share."""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rollcli.errors import InputError
from rollcli.rig.formats.yaml import Value

_LONGEST = 40  # characters of a number: no calibration has more digits
_SAME_FOCAL = 1e-3  # relative: the views of a rectified pair have one focal length
_SAME_ROW = 0.5  # px: and one row of the principal point


class File(NamedTuple):
    """The text of a calibration file, and what errors call it."""

    name: str
    text: str


@dataclass(frozen=True)
class Fields:
    """What one calibration says: the attributes of `Calibration`, each None where it does not say it.

    Attributes
    ----------
    lacks : str
        Why something is None: the end of the sentence "FILE ...".
    notes : tuple of str
        What a user should know about how the file was read.
    """

    fx: float | None = None
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None
    baseline: float | None = None
    doffs: float | None = None
    width: int | None = None
    height: int | None = None
    lacks: str = ""
    notes: tuple[str, ...] = ()


class Projection(NamedTuple):
    """A rectified view: K and what K^-1 makes of the fourth column of its 3x4 projection."""

    fx: float
    fy: float
    cx: float
    cy: float
    tx: float
    ty: float

    @classmethod
    def of(cls, numbers: Sequence[float], what: str) -> "Projection":
        """Read a 3x4 projection, row by row.

        The fourth column is K t with all three components of t: dividing its first number by the focal
        length is 0.3 % off for KITTI's colour cameras.
        """
        if len(numbers) != 12:
            raise InputError(f"{what} has {len(numbers)} numbers: a 3x4 projection has 12")
        fx, skew, cx, px, zero, fy, cy, py, *last, tz = numbers
        if last != [0, 0, 1] or zero != 0 or skew != 0 or fx == 0 or fy == 0:
            raise InputError(f"{what} is no projection of a rectified view")
        return cls(fx, fy, cx, cy, (px - cx * tz) / fx, (py - cy * tz) / fy)


def keys_and_values(text: str, sign: str) -> Iterator[tuple[str, str]]:
    """Yield key and value of each line that has the sign between them."""
    for line in text.splitlines():
        key, found, value = line.partition(sign)
        if found:
            yield key.strip(), value.strip()


def has_key(sign: str, *keys: str) -> Callable[[str], bool]:
    """Return what tells whether a line of a text gives one of these keys a value."""
    return lambda text: any(key in keys for key, _ in keys_and_values(text, sign))


def json_values(file: File) -> dict[str, Value]:
    """Return the values of a JSON object, numbers as text."""
    try:
        # as text: Python reads numbers of thousands of digits slowly, or refuses them
        values = json.loads(file.text, parse_int=str, parse_float=str, parse_constant=str)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file.name}: is not whole JSON: {error}") from error
    if not isinstance(values, dict):
        raise InputError(f"{file.name}: is no JSON object")
    return values


def number(value: Value, what: str) -> float:
    """Return the finite number that a text is."""
    if isinstance(value, str) and len(value) <= _LONGEST:
        try:
            found = float(value)
        except ValueError:
            found = math.nan
        if math.isfinite(found):
            return found
    shown = value if isinstance(value, str) else "not a number"
    raise InputError(f"{what} is {shown[:_LONGEST]!r}: a finite number is needed")


def numbers(values: Value | Iterable[str], what: str) -> list[float]:
    """Return the finite numbers of a list."""
    if isinstance(values, str | dict):
        raise InputError(f"{what} is not a list of numbers")
    return [number(value, what) for value in values]


def size_of(width: Value | None, height: Value | None, what: str) -> tuple[int | None, int | None]:
    """Return an image size in whole pixels; None where a side is not stated."""
    if width is None or height is None:
        return None, None
    found = number(width, what), number(height, what)
    if not all(1 <= side <= 1e6 and side == int(side) for side in found):
        raise InputError(f"{what} is {found[0]:g}x{found[1]:g} px: that is no image")
    return int(found[0]), int(found[1])


def pair_of(left: Projection, right: Projection, where: str) -> tuple[float, float]:
    """Return baseline, in the unit of the projections, and doffs of two rectified views.

    The baseline is negative where the right view's camera stands left of the other.

    Raises
    ------
    InputError
        The views are one above the other, or they do not belong to one rectified pair.
    """
    across, up = left.tx - right.tx, left.ty - right.ty
    if abs(up) > abs(across):
        raise InputError(
            f"{where} is a vertical rig, one camera above the other: only horizontal ones are read"
        )
    if across == 0:
        raise InputError(f"{where} has no distance between the cameras: its projections are the same")
    require_one_pair((left.fx, left.fy, left.cy), (right.fx, right.fy, right.cy), where)
    return across, right.cx - left.cx


def require_one_pair(left: tuple[float, float, float], right: tuple[float, float, float], where: str) -> None:
    """Refuse two views, each (fx, fy, cy), that are not those of one rectified pair.

    Raises
    ------
    InputError
    """
    tolerances = (_SAME_FOCAL * abs(left[0]), _SAME_FOCAL * abs(left[1]), _SAME_ROW)
    if any(abs(a - b) > most for a, b, most in zip(left, right, tolerances, strict=True)):
        one, other = (", ".join(f"{value:g}" for value in view) for view in (left, right))
        raise InputError(
            f"{where} is contradictory: fx, fy and cy of the two views are {one} and {other} px, "
            "and those of a rectified pair are equal"
        )


def swapped(where: str) -> InputError:
    """Return the error for a right camera that stands left of the left one."""
    return InputError(
        f"{where} is contradictory: its right camera stands left of its left one; are they swapped?"
    )
