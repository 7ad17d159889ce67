"""Option values that click has no type for: each turns text, or a value of a TOML file, into numbers."""

import math
import re
from collections.abc import Callable
from functools import partial
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Literal

import click

if TYPE_CHECKING:  # generic to type checkers only, before click 8.4
    ParamType = click.ParamType[Any]
    _Choice = click.Choice[str]
else:
    ParamType = click.ParamType
    _Choice = click.Choice


# endings that promise a format; a name with any other ending is a name like "rolls.txt" or "rolls"
_OTHER_FORMATS = {
    *(".csv", ".tsv", ".json", ".jsonl", ".ndjson", ".parquet", ".feather", ".gz", ".bz2", ".xz", ".zst"),
    *(".xlsx", ".xls", ".ods", ".xml", ".yaml", ".toml", ".html", ".htm", ".pdf"),
}


class Choice(_Choice):
    """One of some words; upper and lower case are the same."""

    def __init__(self, *words: str) -> None:
        super().__init__(words, case_sensitive=False)
        self.metavar = f"[{'|'.join(words)}]"  # as they are given: versions of click differ in that


FLAG = click.BOOL  # of options that are given alone


class Text(click.types.StringParamType):
    """Any text but an empty one, which would choose nothing."""

    def __init__(self, metavar: str) -> None:
        self.metavar = metavar

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the text is empty: is a variable unset?", param, ctx)
        return super().convert(value, param, ctx)


class FilePath(click.Path):
    """The name of a file or folder; an empty one, which would mean the current folder, is refused.

    Parameters
    ----------
    metavar : str or None
        The placeholder in the help.
    endings : tuple of str
        Of a file that is written: endings of what is written, lower case, the usual one first. That of a
        format which is not written there is refused. By default any ending is taken.
    what : str
        What is written, in words.
    """

    def __init__(self, metavar: str | None = None, endings: tuple[str, ...] = (), what: str = "") -> None:
        super().__init__()
        self.metavar, self.endings, self.what = metavar, endings, what

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the name is empty: is a variable unset?", param, ctx)
        if value == "-" and self is DIR:
            self.fail("'-' is stdin or stdout, and no folder; one of this name is './-'", param, ctx)
        ending = PurePath(str(value)).suffix.lower()
        if self.endings and ending in _OTHER_FORMATS.difference(self.endings):
            self.fail(f"{value!r}: {ending} is not written here; write {self.what}", param, ctx)
        return super().convert(value, param, ctx)


# whether they exist, their reader says: in the same words wherever the name came from
PATH, FILE, DIR, RESULT = FilePath(), FilePath("FILE"), FilePath("DIR"), FilePath("RESULT")
OutputFile = partial(FilePath, "FILE")
TABLE_FILE = OutputFile((".csv", ".json"), "CSV (.csv), JSON (.json), or a table to read (any other name)")
TABLE_FORMATS = ("table", "csv", "json")


def table_format(given: str | None, output: str) -> str:
    """Choose one of `TABLE_FORMATS`: the one given, else by the ending of the output."""
    ending = PurePath(output).suffix.lower().removeprefix(".")
    return given or (ending if ending in TABLE_FORMATS[1:] else TABLE_FORMATS[0])


class Number(ParamType):
    """A finite number within bounds, with its unit as the placeholder.

    `auto` is what the word "auto" stands for; False: it is no value.
    """

    def __init__(
        self,
        unit: str,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
        auto: str | Literal[False] | None = False,
        whole: bool = False,
        but: float = math.nan,
    ) -> None:
        self.name, self.metavar, self.but = unit, unit if auto is False else f"{unit}|auto", but
        self.above, self.at_least, self.at_most = above, at_least, at_most
        self.auto, self.whole = auto, whole
        bounds = {"above": above, "other than": but, "of at least": at_least, "of at most": at_most}
        bounded = " and ".join(f"{word} {bound:g}" for word, bound in bounds.items() if math.isfinite(bound))
        words = "a whole number" if whole else "a number", bounded, "" if auto is False else "or auto"
        self.what = " ".join(filter(None, words))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if self.auto is not False and value == "auto":
            return self.auto
        try:
            number = int(value) if self.whole and not isinstance(value, float) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        within = self.above < number and self.at_least <= number <= self.at_most
        fits = within and math.isfinite(number) and number != self.but
        if not fits or isinstance(value, bool) or (self.whole and number != int(number)):
            self.fail(f"{value!r} is not {self.what}", param, ctx)
        return int(number) if self.whole else number


class Parsed(ParamType):
    """What a function makes of a text, or of a value of TOML; its ValueError or TypeError refuses the value.

    Parameters
    ----------
    metavar : str
        The placeholder in the help.
    parse : callable
    what : str
        What is accepted, in words.
    between : str
        What stands between the numbers of a default in the help.
    """

    def __init__(self, metavar: str, parse: Callable[[Any], Any], what: str, between: str = "") -> None:
        self.name = self.metavar = metavar
        self.parse, self.what, self.between = parse, what, between

    def shown(self, value: Any) -> str:
        """Return a default as it would be given; of a range of one number that number."""
        one = self.between == ":" and len(set(value)) == 1
        return self.between.join(f"{each:g}" for each in (value[:1] if one else value))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self.parse(value)
        except (TypeError, ValueError):
            self.fail(f"{value!r} is not {self.what}", param, ctx)


def _require(holds: bool) -> None:
    if not holds:
        raise ValueError


def _numbers(
    separators: str, holds: Callable[..., bool], *, whole: bool = False
) -> Callable[[Any], tuple[Any, ...]]:
    """Return what takes as many numbers between separators as `holds` does, if that holds of them.

    Whole ones have at most nine digits, and no sign; others are finite.
    """

    def parse(value: Any) -> tuple[Any, ...]:
        parts = value if isinstance(value, list | tuple) else re.split(f"[{separators}]", str(value))
        numbers = tuple(int(str(part)) if whole else float(part) for part in parts)
        _require(all(0 <= each < 10**9 if whole else math.isfinite(each) for each in numbers))
        _require(holds(*numbers))
        return numbers

    return parse


def span(least: float, most: float) -> Parsed:
    """Return the type of a range of numbers within bounds; one number is a range too."""
    ends = _numbers(":", lambda low, high=None: least <= low <= (low if high is None else high) <= most)
    what = f"A:B with {least:g} <= A <= B <= {most:g}, nor one such number"
    return Parsed("A:B", lambda value: (2 * ends(value))[:2], what, ":")


def _any_number(value: Any) -> float:
    _require(not isinstance(value, bool))
    return float(value)


_FAR = 1_000_000  # pixels; OpenCV goes through every row of a polygon, also those outside of the map
_point = _numbers(",", lambda u, v: True)


def _polygon(value: Any) -> tuple[tuple[float, float], ...]:
    corners = tuple(map(_point, value.split() if isinstance(value, str) else value))
    _require(len(corners) >= 3 and max(abs(each) for corner in corners for each in corner) <= _FAR)
    return corners


_box = _numbers(",", lambda x0, y0, x1, y1: x0 < x1 and y0 < y1, whole=True)
_part = _numbers("/", lambda part, parts: 1 <= part <= parts, whole=True)
_size = _numbers("xX×", lambda width, height: 16 <= width <= 16384 and 16 <= height <= 16384, whole=True)
_turns = _numbers(  # at most 1000 angles
    ":", lambda low, high, step: -90 <= low <= high <= 90 and step > 0 and high - low <= 1000 * step
)
_wide = _numbers(":", lambda low, high: low < high)
WIDE_SPAN = Parsed("A:B", _wide, "A:B with A < B, such as -0.1:0.1", ":")
ANY_NUMBER = Parsed("VALUE", _any_number, "a number")  # that a pixel may hold: also nan and inf
ROI = Parsed("X0,Y0,X1,Y1", _box, "X0,Y0,X1,Y1 in whole pixels with 0 <= X0 < X1 and 0 <= Y0 < Y1")
POINT = Parsed("CX,CY", _point, "CX,CY in pixels, such as 609.6,172.9")
POLYGON = Parsed(
    "'X,Y X,Y X,Y …'",
    _polygon,
    "three or more corners such as '0,375 600,180 1242,375', within a million pixels",
)
SHARD = Parsed("I/N", _part, "I/N with I from 1 to N, such as 2/8", "/")
TURNS = Parsed("A:B:STEP", _turns, "A:B:STEP in degrees with -90 <= A <= B <= 90, such as -20:20:2", ":")
IMAGE_SIZE = Parsed("WxH", _size, "WxH in whole pixels, 16 to 16384 each way, such as 640x480", "x")
