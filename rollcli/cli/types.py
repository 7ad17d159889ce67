"""Option values that click has no type for: each turns text, or a value of a TOML file, into numbers."""

import math
import re
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:  # generic to type checkers only, before click 8.4
    ParamType = click.ParamType[Any]
    _Choice = click.Choice[str]
else:
    ParamType = click.ParamType
    _Choice = click.Choice


# endings that promise a format; a name with any other ending is a name like "rolls.txt" or "rolls"
_OTHER_FORMATS = {
    *(".csv", ".tsv", ".json", ".jsonl", ".ndjson", ".parquet", ".feather"),
    *(".xlsx", ".xls", ".ods", ".xml", ".yaml", ".toml", ".html", ".htm", ".pdf"),
}


class Choice(_Choice):
    """One of some words; upper and lower case are the same."""

    def __init__(self, *words: str) -> None:
        super().__init__(words, case_sensitive=False)


class FilePath(click.Path):
    """The name of a file or folder; an empty one, which would mean the current folder, is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the name is empty: is a variable unset?", param, ctx)
        return super().convert(value, param, ctx)


class OutputFile(FilePath):
    """The name of a file to write; the ending of a format that is not written there is refused.

    Parameters
    ----------
    endings : tuple of str
        Endings of what is written, lower case, the usual one first.
    what : str
        What is written, in words.
    """

    def __init__(self, endings: tuple[str, ...], what: str) -> None:
        super().__init__()
        self.endings, self.what = endings, what

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        ending = PurePath(str(value)).suffix.lower()
        if ending in _OTHER_FORMATS.difference(self.endings):
            self.fail(f"{value!r}: {ending} is not written here; write {self.what}", param, ctx)
        return super().convert(value, param, ctx)


TABLE_FILE = OutputFile((".csv", ".json"), "CSV (.csv), JSON (.json), or a table to read (any other name)")
TABLE_FORMATS = ("table", "csv", "json")


def table_format(given: str | None, output: str) -> str:
    """Choose one of `TABLE_FORMATS`: the one given, else by the ending of the output."""
    ending = PurePath(output).suffix.lower().removeprefix(".")
    return given or (ending if ending in TABLE_FORMATS[1:] else TABLE_FORMATS[0])


class Number(ParamType):
    """A finite number within bounds, with its unit as the placeholder; "auto" where that is allowed."""

    def __init__(
        self,
        unit: str,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
        auto: bool = False,
        whole: bool = False,
        but: float | None = None,
    ) -> None:
        self.name, self.but = unit, but
        self.above, self.at_least, self.at_most = above, at_least, at_most
        self.auto, self.whole = auto, whole

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return f"{self.name}|auto" if self.auto else self.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        if self.auto and value == "auto":
            return "auto"
        try:
            number = int(value) if self.whole and not isinstance(value, float) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        fits = (
            math.isfinite(number)
            and number != self.but
            and self.above < number
            and self.at_least <= number <= self.at_most
        )
        if not fits or isinstance(value, bool) or (self.whole and number != int(number)):
            self.fail(f"{value!r} is not {self.describe()}", param, ctx)
        return int(number) if self.whole else number

    def describe(self) -> str:
        """Describe in words what is accepted."""
        words = "a whole number" if self.whole else "a number"
        bounds = [
            f"above {self.above:g}" if self.above > -math.inf else "",
            f"other than {self.but:g}" if self.but is not None else "",
            f"of at least {self.at_least:g}" if self.at_least > -math.inf else "",
            f"of at most {self.at_most:g}" if self.at_most < math.inf else "",
        ]
        return " ".join(
            filter(None, [words, " and ".join(filter(None, bounds)), "or auto" if self.auto else ""])
        )


class Span(ParamType):
    """A:B, from the lowest to the highest; one number stands for both, unless they must differ."""

    name = "A:B"

    def __init__(self, *, wide: bool = False) -> None:
        self.wide = wide

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value  # the default
        try:
            ends = [float(end) for end in str(value).split(":")]
        except ValueError:
            ends = []
        if self.wide and (len(ends) != 2 or not ends[0] < ends[1] or not all(map(math.isfinite, ends))):
            self.fail(f"{value!r} is not A:B with A < B, such as -0.1:0.1", param, ctx)
        if len(ends) not in (1, 2) or not all(map(math.isfinite, ends)) or ends[0] > ends[-1]:
            self.fail(f"{value!r} is not A:B with A <= B, such as -5:5, nor a single number", param, ctx)
        return ends[0], ends[-1]


class NumberOrNan(ParamType):
    """Any number that a pixel may hold: also nan and inf."""

    name = "VALUE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = None if isinstance(value, bool) else float(value)
        except (TypeError, ValueError):
            number = None
        return self.fail(f"{value!r} is not a number", param, ctx) if number is None else number


class Roi(ParamType):
    """Four whole numbers with X0 < X1 and Y0 < Y1."""

    name = "X0,Y0,X1,Y1"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int, int, int]:
        text = ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
        found = re.fullmatch(r"\s*(\d{1,9})\s*,\s*(\d{1,9})\s*,\s*(\d{1,9})\s*,\s*(\d{1,9})\s*", text)
        x0, y0, x1, y1 = (int(number) for number in found.groups()) if found else (0, 0, 0, 0)
        if not (x0 < x1 and y0 < y1):
            self.fail(f"{text!r} is not X0,Y0,X1,Y1 in whole pixels with X0 < X1 and Y0 < Y1", param, ctx)
        return x0, y0, x1, y1


class Point(ParamType):
    """A column and a row, which need not be whole."""

    name = "CX,CY"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        text = ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != 2 or not all(map(math.isfinite, numbers)):
            self.fail(f"{text!r} is not CX,CY in pixels, such as 609.6,172.9", param, ctx)
        return numbers[0], numbers[1]


class Polygon(ParamType):
    """Three or more corners."""

    name = "'x,y x,y x,y …'"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[tuple[float, float], ...]:
        corners = value.split() if isinstance(value, str) else value
        try:
            points = [tuple(map(float, c.split(",") if isinstance(c, str) else c)) for c in corners]
        except (TypeError, ValueError):
            points = []
        if len(points) < 3 or not all(len(p) == 2 and all(map(math.isfinite, p)) for p in points):
            self.fail(f"{value!r} is not three or more corners such as '0,375 600,180 1242,375'", param, ctx)
        return tuple((p[0], p[1]) for p in points)


class Shard(ParamType):
    """I/N with 1 <= I <= N."""

    name = "I/N"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value  # the default
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", str(value))
        part, parts = (int(found[1]), int(found[2])) if found else (0, 0)
        if not 1 <= part <= parts:
            self.fail(f"{value!r} is not I/N with I from 1 to N, such as 2/8", param, ctx)
        return part, parts
