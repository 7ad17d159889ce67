"""One quantity of each frame, as charts show it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rollcli.files.results import Row
from rollcli.report.summary import with_interval
from rollcli.rig.quantities import HEIGHT, Quantity
from rollcli.rig.words import decimals


@dataclass(frozen=True, slots=True)
class Value:
    """A frame and its value; degrees or metres.

    Attributes
    ----------
    number : int
        Of the frame, from 1.
    value : float or None
        None where the frame has none.
    half_width : float or None
        Of the 95 % interval.
    row : Row
    """

    number: int
    value: float | None
    half_width: float | None
    row: Row


def values_of(rows: Sequence[Row], quantity: Quantity) -> list[Value]:
    """Return the value of each frame."""
    return [
        Value(number, getattr(row, quantity.column), getattr(row, quantity.ci_column), row)
        for number, row in enumerate(rows, 1)
    ]


def in_words(each: Value, quantity: Quantity) -> str:
    """Return a value with its interval and unit; "" where there is none."""
    if each.value is None:
        return ""
    if quantity is not HEIGHT:
        return with_interval(each.value, each.half_width)
    digits = decimals(each.half_width)
    half = "" if each.half_width is None else f" ± {each.half_width:.{digits}f}"
    return f"{each.value:.{digits}f}{half}{quantity.unit}"
