"""Which frames a report shows in pictures: the worst, suspect ones, and some evenly spread over the rest."""

from collections.abc import Sequence
from dataclasses import dataclass

from rollcli.files.results import Row

WIDEST, SUSPECT, SPREAD = "widest interval", "suspect", "evenly spread"


@dataclass(frozen=True)
class Choice:
    """A frame to show, by its place among the rows, and why."""

    place: int
    reason: str


def choose(rows: Sequence[Row], count: int) -> list[Choice]:
    """Choose up to `count` frames that have an angle: a third each of the kinds that there are.

    Parameters
    ----------
    rows : sequence of Row
    count : int

    Returns
    -------
    list of Choice
        The widest intervals first, from the widest on; then suspect frames and others, in their order.
    """
    angled = [place for place, row in enumerate(rows) if row.roll_deg is not None]
    share = count // 3
    widths = [(-(rows[place].roll_ci95_deg or 0.0), place) for place in angled]
    chosen = [Choice(place, WIDEST) for width, place in sorted(widths)[:share] if width < 0]
    rest = _without(angled, chosen)
    doubtful = [place for place in rest if rows[place].status == "suspect"]
    chosen += [Choice(place, SUSPECT) for place in spread(doubtful, share)]
    rest = _without(angled, chosen)
    return chosen + [Choice(place, SPREAD) for place in spread(rest, count - len(chosen))]


def spread(places: Sequence[int], count: int) -> list[int]:
    """Up to `count` of the places, evenly spread, each in the middle of its stretch."""
    if count >= len(places):
        return list(places)
    return [places[(2 * i + 1) * len(places) // (2 * count)] for i in range(count)]


def _without(places: Sequence[int], chosen: Sequence[Choice]) -> list[int]:
    taken = {each.place for each in chosen}
    return [place for place in places if place not in taken]
