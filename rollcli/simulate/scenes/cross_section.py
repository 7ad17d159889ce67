"""The cross section of a carriageway: its height across, in pieces side by side.

The crossfall is the slope across the carriageway against the horizontal. It is the same everywhere on a roof
and on a superelevated road; on a crown or a dish, which are parabolas, it is the slope at the edges.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from rollcli.simulate.options import GUTTER_WIDTH


class Piece(NamedTuple):
    """elevation = offset + slope * lateral + camber / 2 * lateral^2, metres, for laterals in [start, end)."""

    start: float
    end: float
    slope: float = 0.0
    camber: float = 0.0
    offset: float = 0.0

    def elevation(self, lateral: float) -> float:
        """Return the height at a lateral position, metres."""
        return self.offset + (self.slope + self.camber / 2 * lateral) * lateral

    def slope_at(self, lateral: float) -> float:
        """Return the slope at a lateral position; positive where the road rises to the right."""
        return self.slope + self.camber * lateral

    def curvature_at(self, lateral: float) -> float:
        """Return the second derivative of the height over the plane tangent at a lateral position, 1/m."""
        return float(self.camber / math.hypot(1.0, self.slope_at(lateral)) ** 3)


@dataclass(frozen=True)
class CrossSection:
    """Pieces from left to right, without steps; the elevation is 0 where lateral is 0."""

    pieces: tuple[Piece, ...]

    def piece(self, lateral: float) -> Piece:
        """Return the piece at a lateral position; beyond the edges the outermost one."""
        return next((piece for piece in self.pieces if lateral < piece.end), self.pieces[-1])

    def elevation(self, lateral: float) -> float:
        """Return the height above the point below the rig, metres; beyond an edge that of the edge."""
        inside = min(max(lateral, self.pieces[0].start), self.pieces[-1].end)
        return self.piece(inside).elevation(inside)


def cross_section(
    shape: str, crossfall: float, gutter: float, left: float, right: float, bend: float
) -> CrossSection:
    """Make the cross section of a carriageway.

    Parameters
    ----------
    shape : str
        One of `CROSS_SECTIONS`.
    crossfall, gutter : float
        Slopes in metres per metre: the steepest of the carriageway, and how much steeper its outer
        `GUTTER_WIDTH` falls outward.
    left, right : float
        The edges (lateral, metres).
    bend : float
        The road's horizontal curvature, 1/m: superelevation raises the outer side of a bend. A straight
        road falls to the right.
    """
    middle, half = (left + right) / 2, (right - left) / 2
    inner = _SHAPES[shape](crossfall, middle, half, bend)
    return CrossSection(_through_origin(_add_gutters(inner, gutter) if gutter else inner))


def _flat(crossfall: float, middle: float, half: float, bend: float) -> tuple[Piece, ...]:
    return (Piece(middle - half, middle + half),)


def _crown(crossfall: float, middle: float, half: float, bend: float) -> tuple[Piece, ...]:
    camber = -crossfall / half
    return (Piece(middle - half, middle + half, -camber * middle, camber),)


def _dish(crossfall: float, middle: float, half: float, bend: float) -> tuple[Piece, ...]:
    return _crown(-crossfall, middle, half, bend)


def _roof(crossfall: float, middle: float, half: float, bend: float) -> tuple[Piece, ...]:
    rising = Piece(middle - half, middle, crossfall, offset=-2 * crossfall * middle)
    return rising, Piece(middle, middle + half, -crossfall)


def _superelevated(crossfall: float, middle: float, half: float, bend: float) -> tuple[Piece, ...]:
    return (Piece(middle - half, middle + half, crossfall if bend < 0 else -crossfall),)


_SHAPES = {
    "flat": _flat,
    "crown": _crown,
    "roof": _roof,
    "dish": _dish,
    "superelevated": _superelevated,
}


def _add_gutters(pieces: tuple[Piece, ...], gutter: float) -> tuple[Piece, ...]:
    """Replace the outer ends of the carriageway by straight pieces that fall outward more steeply."""
    first, last = pieces[0], pieces[-1]
    left, right = first.start + GUTTER_WIDTH, last.end - GUTTER_WIDTH
    kept = [*pieces]
    kept[0] = kept[0]._replace(start=left)
    kept[-1] = kept[-1]._replace(end=right)
    return (
        _straight(first.start, left, left, first, gutter),
        *kept,
        _straight(right, last.end, right, last, -gutter),
    )


def _straight(start: float, end: float, at: float, beside: Piece, steeper: float) -> Piece:
    slope = beside.slope_at(at) + steeper
    return Piece(start, end, slope, offset=beside.elevation(at) - slope * at)


def _through_origin(pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
    below_rig = CrossSection(pieces).elevation(0.0)
    return tuple(piece._replace(offset=piece.offset - below_rig) for piece in pieces)
