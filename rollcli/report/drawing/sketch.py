"""What a chart consists of once it is laid out: lines, areas, marks and words at their places."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.floating[Any]]  # shape (N, 2): x to the right, y down, pixels
Symbol = Literal["circle", "diamond", "cross"]
Anchor = Literal["start", "middle", "end"]


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points; `dash` is how long a dash and a gap are, pixels, 0 for none."""

    points: Points
    colour: str
    width: float
    dash: float = 0.0


@dataclass(frozen=True, eq=False)
class Area:
    """A filled polygon."""

    points: Points
    colour: str


@dataclass(frozen=True, eq=False)
class Marks:
    """The same symbol at each of the points; `size` is its diameter, pixels."""

    points: Points
    colour: str
    symbol: Symbol
    size: float


@dataclass(frozen=True)
class Words:
    """A line of text; `x` and `y` are of its baseline. One that is `upright` reads from below to above."""

    x: float
    y: float
    text: str
    colour: str
    anchor: Anchor = "start"
    upright: bool = False


Item = Line | Area | Marks | Words


@dataclass(frozen=True, eq=False)
class Sketch:
    """A chart, laid out.

    Attributes
    ----------
    label : str
        What it shows, for those who cannot see it.
    width, height : int
        Pixels.
    font : float
        Size of its text, pixels.
    frame : (int, int, int, int)
        Left, top, width and height of the part where the values are.
    inside : tuple of Item
        In this order, cut off at the frame; their places count from its corner.
    around : tuple of Item
        Axes and legend.
    """

    label: str
    width: int
    height: int
    font: float
    frame: tuple[int, int, int, int]
    inside: tuple[Item, ...]
    around: tuple[Item, ...]
