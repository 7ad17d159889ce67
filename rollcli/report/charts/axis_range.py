"""Which values the charts of a report show at first."""

from collections.abc import Iterable, Sequence

from rollcli.files.results import Row
from rollcli.report.charts.values import Value, values_of
from rollcli.rig.quantities import HEIGHT, ROLL, Quantity

_BEYOND = 0.35  # a suspect value may widen the view by this share of the others' range, and by half a degree
_WIDEST = 1.0  # degrees: a wider interval is seen to leave the view
_DEGREE_IN_METRES = 0.1  # what of a height is as much as a degree of an angle


def view(rows: Sequence[Row], quantity: Quantity = ROLL) -> tuple[float, float]:
    """Return the ends of the axis: all values that are ok, and suspect ones that are not far off.

    Parameters
    ----------
    rows : sequence of Row
    quantity : Quantity

    Returns
    -------
    tuple of float
        Degrees or metres, the lower end first.
    """
    unit = _DEGREE_IN_METRES if quantity is HEIGHT else 1.0
    there = [each for each in values_of(rows, quantity) if each.value is not None]
    if not there:
        return -unit, unit
    low, high = _span([each for each in there if each.row.status == "ok"] or there, unit)
    beyond = _BEYOND * (high - low) + 0.5 * unit
    near = [value for each in there if low - beyond <= (value := each.value or 0.0) <= high + beyond]
    low, high = min(low, *near), max(high, *near)  # without their intervals, which are wide
    margin = 0.06 * (high - low) + 0.05 * unit
    return round(low - margin, 3), round(high + margin, 3)


def outside(rows: Sequence[Row], quantity: Quantity = ROLL) -> int:
    """Return how many values lie outside of the view."""
    low, high = view(rows, quantity)
    return sum(each.value is not None and not low <= each.value <= high for each in values_of(rows, quantity))


def _span(values: Iterable[Value], unit: float) -> tuple[float, float]:
    """From the lowest to the highest end of an interval."""
    ends = [
        (each.value or 0.0) + side * min(each.half_width or 0.0, _WIDEST * unit)
        for each in values
        for side in (-1, 1)
    ]
    return min(ends), max(ends)
