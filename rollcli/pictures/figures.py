"""Figures that matplotlib draws: their sizes, look and files, and the figure of a frame for a paper.

They are the same bytes each time. matplotlib is part of the extra `report` and takes a second to load: this
module is imported once something is to be drawn.
"""

import io
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from rollcli.estimator.road.model import Parabola
from rollcli.pictures.colours import LIGHT
from rollcli.pictures.derotate import derotate
from rollcli.pictures.overlay import brightest
from rollcli.pictures.vdisparity import MiddleColumn, VDisparity, shown_counts, shown_end, v_disparity

_SETTINGS = threading.Lock()  # matplotlib has one set of them for all threads
COLUMN = 3.5 * 72  # pt: the width of a column in journals of two columns
_STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": f"#{LIGHT['grid']}",
    "legend.frameon": False,
    "pdf.fonttype": 42,  # letters stay letters
    "svg.fonttype": "none",
    **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), f"#{LIGHT['line']}"),
    **dict.fromkeys(("axes.labelcolor", "text.color"), f"#{LIGHT['text']}"),
    **dict.fromkeys(("xtick.labelcolor", "ytick.labelcolor"), f"#{LIGHT['text']}"),
}
# what a file would say of when and with what it was made
_LEFT_OUT = {
    "svg": ("Date", "Creator", "Format", "Type"),
    "pdf": ("CreationDate", "Creator", "Producer"),
    "png": ("Software",),
}


class Size(NamedTuple):
    """The size of a figure, and of its letters; pt."""

    width: float
    height: float
    font: float


SLIDE = Size(960.0, 420.0, 13.5)  # a slide leaves so much below its title
PRINT = Size(COLUMN, 0.62 * COLUMN, 7.0)


@contextmanager
def drawing_style(size: Size, salt: str = "") -> Iterator[None]:
    """Draw as this program does in the block, whatever a user has set for matplotlib."""
    with _SETTINGS, mpl.rc_context():
        mpl.rcdefaults()
        letters = dict.fromkeys(("font.size", "legend.fontsize", "axes.titlesize"), size.font)
        lines = ("axes.linewidth", "grid.linewidth", "xtick.major.width", "ytick.major.width")
        sizes: dict[Any, Any] = letters | dict.fromkeys(lines, size.font / 13)
        sizes |= dict.fromkeys(("xtick.major.size", "ytick.major.size"), size.font / 4)
        mpl.rcParams.update(_STYLE | sizes | {"svg.hashsalt": f"rollcli {salt}"})
        yield


def figure_file(figure: Figure, kind: str, title: str) -> bytes:
    """Return a figure as a file, the same bytes each time; within `drawing_style`.

    Parameters
    ----------
    figure : Figure
    kind : {"svg", "pdf", "png"}
        PNGs have 144 pixels an inch on a slide, and 600 at the width of a column.
    title : str
        What it shows, for those who cannot see it.
    """
    metadata = {"Title": title, **dict.fromkeys(_LEFT_OUT[kind])}
    buffer = io.BytesIO()
    dots = 600 if figure.get_figwidth() * 72 <= 2 * COLUMN else 144
    figure.savefig(buffer, format=kind, dpi=dots, metadata=metadata, facecolor=f"#{LIGHT['card']}")
    return buffer.getvalue()


_MAP_SHARE = 1.8  # the width of a map, of that of its v-disparity
_MAP_WIDTH = 0.5 * COLUMN  # pt, about; the rest are v-disparity, numbers and names
_AROUND = 92.0  # pt of the height that are names, numbers and the bar of colours
_COLUMNS = 320  # of a v-disparity
_COLOURS, _ROAD = "inferno", "#00e5ff"  # the road in a colour that those of the counts do not have


def v_disparity_figure(
    disparity: NDArray[Any],
    theta: float,
    alpha: Parabola | None,
    kind: str,
    *,
    bins: int | None = None,
    max_disparity: float | None = None,
) -> bytes:
    """Draw a map and its v-disparity, before and after de-rotation, as wide as a journal's column.

    Parameters
    ----------
    disparity : ndarray, shape (H, W)
        Pixels; NaN, inf and <= 0 are no data.
    theta : float
        Roll, radians.
    alpha : tuple of float, or None
        The road: d = a0 + a1 y + a2 y^2, px, y measured as the method does. None: no curve is drawn.
    kind : {"svg", "pdf", "png"}
    bins, max_disparity
        See `v_disparity`.

    Returns
    -------
    bytes
        The file, the same each time; maps and counts in it are pictures, the rest is lines and letters.
    """
    height, width = disparity.shape
    maps = (disparity, derotate(disparity, theta))
    titles = ("as it is", "de-rotated by " + f"{math.degrees(theta):.2f}°".replace("-", "−"))
    columns = MiddleColumn.of_map(theta, width), MiddleColumn.of_level(theta, width, height)
    curves = [None if alpha is None else column.profile(alpha) for column in columns]
    as_it_is = v_disparity(disparity, bins=bins, max_disparity=max_disparity)
    # colours and counts to the same end: both rows are read by the numbers below
    counted = as_it_is, v_disparity(maps[1], bins=bins, max_disparity=as_it_is.max_disparity)
    end, top = max_disparity or shown_end(as_it_is), brightest(disparity)
    with drawing_style(PRINT):
        tall = 2 * _MAP_WIDTH * height / width + _AROUND
        figure = Figure((COLUMN / 72, tall / 72), layout="constrained")
        axes = figure.subplots(2, 2, width_ratios=(_MAP_SHARE, 1.0), sharex="col", sharey=True)
        for row, (left, right) in enumerate(axes):
            picture = _draw_map(left, maps[row], top, titles[row])
            _draw_counts(right, counted[row], curves[row], end)
            left.set_box_aspect(height / width)
            right.set_box_aspect(height / width * _MAP_SHARE)
        for column, label in enumerate(("column u, px", "disparity, px")):
            axes[1, column].set_xlabel(label)
        figure.colorbar(
            picture, ax=axes[1, 0], location="bottom", label="disparity, px", aspect=30, extend="max"
        ).outline.set_visible(False)
        return figure_file(figure, kind, "Disparity map and v-disparity, as they are and de-rotated")


def _draw_map(axes: Axes, disparity: NDArray[Any], top: float, title: str) -> Any:
    shown = np.ma.masked_where(~(np.isfinite(disparity) & (disparity > 0)), disparity)
    axes.set_title(title, loc="left")
    axes.set_ylabel("row v, px")
    axes.grid(visible=False)
    return axes.imshow(shown, cmap=_COLOURS, vmin=0, vmax=top, interpolation="none", aspect="auto")


def _draw_counts(axes: Axes, histogram: VDisparity, curve: Parabola | None, end: float) -> None:
    height = len(histogram.counts)
    counts, last = shown_counts(histogram, _COLUMNS, end)
    edges = (0.0, last, height - 0.5, -0.5)
    axes.imshow(np.log1p(counts), cmap=_COLOURS, extent=edges, interpolation="none", aspect="auto")
    if curve is not None:
        rows = np.arange(height, dtype=float)
        axes.plot(np.polynomial.Polynomial(curve)(rows), rows, color=_ROAD, linewidth=0.8, linestyle="--")
    axes.set_xlim(0, last)
    axes.set_ylim(height - 0.5, -0.5)
    axes.grid(visible=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
