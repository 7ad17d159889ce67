"""What a calibration file says, and the steps that several formats share."""

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Union

from rollcli.errors import InputError

Value = Union[str, list["Value"], dict[str, "Value"]]  # noqa: UP007 - the alias names itself

_LONGEST = 40  # characters of a number: no calibration has more digits
_SAME_FOCAL = 1e-3  # relative: the views of a rectified pair have one focal length
_SAME_ROW = 0.5  # px: and one row of the principal point
SAME_DOFFS = 0.5  # px: where a file gives it twice
INSTEAD = "give --focal, --principal-point and --baseline of the rectified pair instead"


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


class File(NamedTuple):
    """A calibration file, or a pair of them: its text, and what errors call it."""

    name: str
    text: str

    def error(self, why: str) -> InputError:
        """Return the error that says why the file is not read."""
        return InputError(f"{self.name}: {why}")

    def lines(self, sign: str) -> Iterator[tuple[str, str]]:
        """Yield key and value of each line that has the sign between them."""
        for line in self.text.splitlines():
            key, found, value = line.partition(sign)
            if found:
                yield key.strip(), value.strip()

    def json(self) -> dict[str, Value]:
        """Return the values of a JSON object, numbers as text."""
        try:
            # as text: Python reads numbers of thousands of digits slowly, or refuses them
            values = json.loads(self.text, parse_int=str, parse_float=str, parse_constant=str)
        except (ValueError, RecursionError) as error:
            raise self.error(f"is not whole JSON: {error}") from error
        if not isinstance(values, dict):
            raise self.error("is no JSON object")
        return values

    def number(self, value: Value, key: str) -> float:
        """Return the finite number that a text is."""
        shown = value if isinstance(value, str) else "not a number"
        try:
            found = float(shown[: _LONGEST + 1])
        except ValueError:
            found = math.nan
        if len(shown) > _LONGEST or not math.isfinite(found):
            raise self.error(f"{key} is {shown[:_LONGEST]!r}: a finite number is needed")
        return found

    def numbers(self, values: Value | Iterable[str], key: str) -> list[float]:
        """Return the finite numbers of a list."""
        if isinstance(values, str | dict):
            raise self.error(f"{key} is not a list of numbers")
        return [self.number(value, key) for value in values]

    def size(self, width: Value | None, height: Value | None, key: str) -> tuple[int | None, int | None]:
        """Return an image size in whole pixels; None where a side is not stated."""
        if width is None or height is None:
            return None, None
        found = self.number(width, key), self.number(height, key)
        if not all(1 <= side <= 1e6 and side == int(side) for side in found):
            raise self.error(f"{key} is {found[0]:g}x{found[1]:g} px: that is no image")
        return int(found[0]), int(found[1])

    def projection(self, values: Value | Iterable[str], key: str) -> Projection:
        """Return the view of a 3x4 projection, row by row.

        The fourth column is K t with all three components of t: dividing its first number by the focal
        length is 0.3 % off for KITTI's colour cameras.
        """
        found = self.numbers(values, key)
        if len(found) != 12:
            raise self.error(f"{key} has {len(found)} numbers: a 3x4 projection has 12")
        fx, skew, cx, px, zero, fy, cy, py, *last, tz = found
        if last != [0, 0, 1] or zero != 0 or skew != 0 or fx == 0 or fy == 0:
            raise self.error(f"{key} is no projection of a rectified view")
        return Projection(fx, fy, cx, cy, (px - cx * tz) / fx, (py - cy * tz) / fy)

    def pair(self, left: Projection, right: Projection) -> Fields:
        """Return what the two views of a rectified pair say, the baseline in the unit of the projections.

        It is negative where the right view's camera stands left of the other.

        Raises
        ------
        InputError
            The views are one above the other, or they do not belong to one rectified pair.
        """
        across, up = left.tx - right.tx, left.ty - right.ty
        if abs(up) > abs(across):
            raise self.vertical()
        if across == 0:
            raise self.error("has no distance between the cameras: they were not calibrated as a pair")
        self.require_one_pair((left.fx, left.fy, left.cy), (right.fx, right.fy, right.cy))
        return Fields(left.fx, left.fy, left.cx, left.cy, across, right.cx - left.cx)

    def require_one_pair(self, *views: tuple[float, float, float]) -> None:
        """Refuse two views, each (fx, fy, cy), that are not those of one rectified pair.

        Raises
        ------
        InputError
        """
        tolerances = (_SAME_FOCAL * abs(views[0][0]), _SAME_FOCAL * abs(views[0][1]), _SAME_ROW)
        if any(abs(a - b) > most for a, b, most in zip(*views, tolerances, strict=True)):
            one, other = (", ".join(f"{value:g}" for value in view) for view in views)
            raise self.error(
                f"is contradictory: fx, fy and cy of the two views are {one} and {other} px, "
                "and those of a rectified pair are equal"
            )

    def vertical(self) -> InputError:
        """Return the error for cameras one above the other."""
        return self.error("is a vertical rig, one camera above the other: only horizontal ones are read")

    def swapped(self) -> InputError:
        """Return the error for a right camera that stands left of the left one."""
        return self.error("is contradictory: its right camera stands left of its left one; are they swapped?")


_MOST = 1 << 17  # characters, which PyYAML parses in a second; real calibrations have a few thousand
_MATRIX = "tag:yaml.org,2002:opencv-"
# OpenCV's first line is no directive of YAML, what it appends is no document of its own, and its files may
# lack the space after a key's colon
_NO_YAML = re.compile(r"^%YAML.*|^\.\.\.\s+---", re.MULTILINE)
_TIGHT_KEY = re.compile(r"^( *[\w.]+):(?=\S)", re.MULTILINE)
# PyYAML refuses tabs where other readers do not: anywhere but in the indentation
_INNER_TABS = re.compile(r"(?<=\S)[ \t]*\t[ \t]*|^[ \t]+$", re.MULTILINE)


def parse_yaml(file: File) -> dict[str, Value]:
    """Return the values of a YAML document whose top level is a mapping: mappings, sequences and text.

    ROS, Kalibr, ORB-SLAM and OpenCV write it; PyYAML parses it. What they have no use for is refused as soon
    as the parser meets it: anchors and aliases, which can make a few lines fill the memory, and tags, which
    name objects. What follows the end of the first document is left alone unless OpenCV appended it; numbers
    stay the text they are.

    Raises
    ------
    InputError
        The text is no YAML, or has what calibration files have no use for; the line is named.
    """
    text = file.text
    if len(text) > _MOST:
        raise file.error(f"has {len(text)} characters; no calibration in YAML has more than {_MOST}")
    import yaml  # takes 25 ms, and most calibrations are no YAML

    class Loader(yaml.BaseLoader):
        """Build text, lists and mappings, but nothing that an anchor, an alias or a tag asks for."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            event = self.peek_event()  # type: ignore[no-untyped-call]
            tag = getattr(event, "tag", None)
            if event.anchor is not None or not (tag or _MATRIX).startswith(_MATRIX):
                what = f"tag {tag}" if event.anchor is None else f"anchor or alias {event.anchor}"
                line = event.start_mark.line + 1
                raise file.error(f"line {line} has the {what}, which calibrations have no use for")
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            found = super().construct_mapping(node, deep)
            seen = set[str]()
            for key, _ in node.value:
                if key.value in seen:
                    raise file.error(f"line {key.start_mark.line + 1} gives {key.value} a second time")
                seen.add(key.value)
            return found

    if "%YAML:" in text:
        text = _TIGHT_KEY.sub(r"\1: ", text)
    text = _INNER_TABS.sub(" ", _NO_YAML.sub("", text))
    try:
        values = Loader(text).get_data()
    except yaml.MarkedYAMLError as error:
        why = " ".join(filter(None, (error.context, error.problem)))
        why += ": the file is cut off" if "<stream end>" in why or "end of stream" in why else ""
        mark = error.problem_mark or error.context_mark
        raise file.error(f"line {mark.line + 1 if mark else 1} is no YAML: {why}") from error
    except yaml.YAMLError as error:
        raise file.error(f"is no YAML: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise file.error("nests deeper than a calibration does") from error
    if not isinstance(values, dict):
        raise file.error("holds no value that has a name")
    return values


def has_key(sign: str, *keys: str) -> Callable[[File], bool]:
    """Return what tells whether a line of a file gives one of these keys a value."""
    return lambda file: any(key in keys for key, _ in file.lines(sign))


def has_text(*marks: str) -> Callable[[File], bool]:
    """Return what tells whether all of these are in a file."""
    return lambda file: all(mark in file.text for mark in marks)
