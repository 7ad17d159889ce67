"""What plotly's words in a trace mean for a picture."""

from collections.abc import Mapping
from typing import Any

from rollcli.report.drawing.sketch import Symbol

_DASHES = {"dot": 3.0, "dash": 8.0}  # pixels
_SYMBOLS: Mapping[str, Symbol] = {"diamond": "diamond", "x-thin": "cross"}


def colour_of(name: str) -> str:
    """Return one of the page's colours: "@c1" is "c1"."""
    return name.removeprefix("@")


def dash_of(line: Mapping[str, Any]) -> float:
    """Return how long a dash is, pixels; 0 for a whole line."""
    return _DASHES.get(line.get("dash", ""), 0.0)


def symbol_of(marker: Mapping[str, Any]) -> Symbol:
    """Return the shape of a mark."""
    return _SYMBOLS.get(marker.get("symbol", ""), "circle")
