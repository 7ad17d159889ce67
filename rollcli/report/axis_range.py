"""Which angles the charts of a report show at first."""

from collections.abc import Iterable, Sequence

from rollcli.files.results import Row

_BEYOND = 0.75  # a suspect angle may widen the view by this share of the others' range
_WIDEST = 1.0  # degrees: a wider interval is seen to leave the view


def view(rows: Sequence[Row]) -> tuple[float, float]:
    """Return the ends of the axis, degrees: all angles that are ok, and suspect ones that are not far off."""
    angled = [row for row in rows if row.roll_deg is not None]
    if not angled:
        return -1.0, 1.0
    low, high = _span([row for row in angled if row.status == "ok"] or angled)
    beyond = _BEYOND * (high - low) + 0.5
    low, high = _span(row for row in angled if low - beyond <= (row.roll_deg or 0.0) <= high + beyond)
    margin = 0.06 * (high - low) + 0.05
    return round(low - margin, 3), round(high + margin, 3)


def outside(rows: Sequence[Row]) -> int:
    """Return how many angles lie outside of the view."""
    low, high = view(rows)
    return sum(row.roll_deg is not None and not low <= row.roll_deg <= high for row in rows)


def _span(rows: Iterable[Row]) -> tuple[float, float]:
    """From the lowest to the highest end of an interval."""
    ends = [
        (row.roll_deg or 0.0) + side * min(row.roll_ci95_deg or 0.0, _WIDEST)
        for row in rows
        for side in (-1, 1)
    ]
    return min(ends), max(ends)
