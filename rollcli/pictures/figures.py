"""Figures that matplotlib draws: their sizes, their look, and their files; the same bytes each time.

matplotlib is part of the extra `report` and takes a second to load: this module is imported once something is
to be drawn.
"""

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.figure import Figure

from rollcli.pictures.colours import LIGHT

_SETTINGS = threading.Lock()  # matplotlib has one set of them for all threads
COLUMN = 3.5 * 72  # pt: the width of a column in journals of two columns
_STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": f"#{LIGHT['line']}",
    "axes.grid": True,
    "axes.labelcolor": f"#{LIGHT['text']}",
    "grid.color": f"#{LIGHT['grid']}",
    "legend.frameon": False,
    "pdf.fonttype": 42,  # letters stay letters
    "svg.fonttype": "none",
    "text.color": f"#{LIGHT['text']}",
    "xtick.color": f"#{LIGHT['line']}",
    "xtick.labelcolor": f"#{LIGHT['text']}",
    "ytick.color": f"#{LIGHT['line']}",
    "ytick.labelcolor": f"#{LIGHT['text']}",
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
    """Draw as this program does, whatever a user has set for matplotlib; what he has set is put back."""
    with _SETTINGS, mpl.rc_context():
        mpl.rcdefaults()
        sizes: dict[Any, Any] = {
            "font.size": size.font,
            "axes.linewidth": size.font / 13,
            "grid.linewidth": size.font / 13,
        }
        sizes |= {f"{axis}tick.major.width": size.font / 13 for axis in "xy"}
        sizes |= {f"{axis}tick.major.size": size.font / 4 for axis in "xy"}
        sizes |= {"legend.fontsize": size.font, "axes.titlesize": size.font}
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
    metadata: dict[str, str | None] = {"Title": title}
    if kind == "svg":
        metadata |= dict.fromkeys(("Date", "Creator", "Format", "Type"))
    elif kind == "pdf":
        metadata |= dict.fromkeys(("CreationDate", "Creator", "Producer"))
    else:
        metadata |= {"Software": None}
    buffer = io.BytesIO()
    dots = 600 if figure.get_figwidth() * 72 <= 2 * COLUMN else 144
    figure.savefig(buffer, format=kind, dpi=dots, metadata=metadata, facecolor=f"#{LIGHT['card']}")
    return buffer.getvalue()
