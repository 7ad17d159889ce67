"""The charts of the paper's experiments, which matplotlib draws: for the page, and as figures for a paper."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import EngFormatter, Formatter, NullLocator, StrMethodFormatter
from numpy.typing import NDArray

from rollcli.estimator.request import LAMBDA0
from rollcli.evaluate.paper_tables import DELTAS_DEG, METHOD_NAMES, SOLVER_NAMES, Table, Value, column
from rollcli.report.figures import Drawing, colour

_COLOURS = {"gd": "c1", "gss": "c2", "exact": "c3"}
_DEGREES = [f"{delta:g}°" for delta in DELTAS_DEG]
_DELTA = r"$\mathregular{δ_θ}$"
_OPEN: dict[str, Any] = {"markerfacecolor": "none", "markersize": 15.0}  # around the mark of another line


def paper_figures(tables: Mapping[str, Table]) -> dict[str, Drawing]:
    """Return every chart of the page, by the name of its table."""
    made = {
        "table1_iterations": (_iterations, "Iterations of both solvers by tolerance, beside the paper's"),
        "table2_runtime": (_runtime, "Run time of both solvers in three forms and in the paper, logarithmic"),
        "fig3_lambda0": (_sweep, "Iterations of gradient descent by its first learning rate"),
        "fig6_accuracy": (_solvers, "Mean error of three solvers after known rotations, by tolerance"),
        "methods_accuracy": (_methods, "Median, 95 % and worst error of five methods after known rotations"),
    }
    return {name: Drawing(name, label, partial(draw, tables[name])) for name, (draw, label) in made.items()}


def _iterations(table: Table, axes: Axes, scale: float) -> None:
    for solver in ("gss", "gd"):
        name, look = SOLVER_NAMES[solver], _COLOURS[solver]
        ours, papers = (column(table, each, solver=solver) for each in ("mean", "paper"))
        _line(axes, scale, _DEGREES, ours, name, look)
        _line(axes, scale, _DEGREES, papers, f"{name}, paper", look, linestyle="none", **_OPEN)
    axes.set(xlabel=_DELTA, ylabel="iterations", ylim=(0, None))


def _runtime(table: Table, axes: Axes, scale: float) -> None:
    forms = {
        "paper_s": ("paper (Matlab)", "c6"),
        "textbook_s": ("n × 3 form", "c4"),
        "with_pass_s": ("moments, with the pass over the map", "c3"),
        "moments_s": ("moments", "c1"),
    }
    count = len(_DEGREES)
    for first, solver in ((0, "gss"), (count, "gd")):
        places = first + np.arange(count)
        for form, (name, look) in forms.items():
            # matplotlib's legend leaves out what begins with a stroke
            seconds = column(table, form, solver=solver)
            _line(axes, scale, places, seconds, f"_{name}" if first else name, look)
        where: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom"}
        axes.text(float(places.mean()), 1.02, SOLVER_NAMES[solver], **where)
    axes.set_xticks(range(2 * count), 2 * _DEGREES, rotation=45)
    axes.set(yscale="log", ylabel="run time")
    _name_decades(axes.yaxis, EngFormatter("s"))


def _sweep(table: Table, axes: Axes, scale: float) -> None:
    for k, delta in enumerate(DELTAS_DEG, 1):
        rates, means = (column(table, each, delta_deg=delta) for each in ("lambda0", "mean"))
        _line(axes, scale, rates, means, f"tolerance {delta:g}°", f"c{k}", marker="")
    axes.axvline(LAMBDA0, color=colour("muted"), linewidth=scale, linestyle=(0, (1.5, 1.5)))
    where: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "va": "bottom"}
    axes.annotate(f" {LAMBDA0:g}", (LAMBDA0, 0), color=colour("muted"), **where)
    axes.set(xlabel="λ(0)", ylabel="iterations, mean over the maps", xlim=(0, 101), ylim=(0, None))


def _solvers(table: Table, axes: Axes, scale: float) -> None:
    for solver, name in SOLVER_NAMES.items():
        # two of them often coincide: the last is drawn open, around the other
        mark = _OPEN if solver == "exact" else {}
        errors = _positive(column(table, "mean_deg", solver=solver))
        _line(axes, scale, _DEGREES, errors, name, _COLOURS[solver], **mark)
    axes.set(xlabel=_DELTA, yscale="log", ylabel="mean |Δθ|")
    _name_decades(axes.yaxis, StrMethodFormatter("{x:g}°"))


def _methods(table: Table, axes: Axes, scale: float) -> None:
    names = [METHOD_NAMES[str(method)] for method in column(table, "method")]
    figures: dict[str, tuple[str, str, dict[str, Any]]] = {
        "median_deg": ("median", "c1", {"markersize": 12.0}),
        "p95_deg": ("95th percentile", "c2", {"marker": "D"}),
        "worst_deg": ("worst", "c5", {"markersize": 12.0, "markerfacecolor": "none"}),
    }
    for figure, (name, look, mark) in figures.items():
        _line(axes, scale, _positive(column(table, figure)), names, name, look, linestyle="none", **mark)
    axes.set(xscale="log", xlabel="|Δθ|")
    axes.margins(y=0.15)
    axes.invert_yaxis()
    _name_decades(axes.xaxis, StrMethodFormatter("{x:g}°"))


def _line(
    axes: Axes, scale: float, x: Any, y: Any, name: str, look: str, *, markersize: float = 8.0, **more: Any
) -> None:
    """Draw a line with marks in a colour of the page; widths and sizes are those of letters of 13 pixels."""
    width, edge = 2 * scale, 2 * scale if "markerfacecolor" in more else 0
    sizes = {"linewidth": width, "markersize": markersize * scale, "markeredgewidth": edge}
    axes.plot(x, y, label=name, color=colour(look), **{"marker": "o", **sizes, **more})


def _positive(values: Sequence[Value]) -> NDArray[Any]:
    """Return NaN for what a logarithmic axis has no place for: no value, and an error of nothing."""
    numbers = np.array(values, float)
    return np.where(numbers > 0, numbers, np.nan)


def _name_decades(axis: Axis, names: Formatter) -> None:
    """Let a logarithmic axis have names at its decades alone, of which it has two at least."""
    low, high = np.log10(axis.get_view_interval())
    if np.ceil(low) >= np.floor(high):
        axis.set_view_interval(10 ** np.floor(low), 10 ** np.ceil(high), ignore=True)
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(names)
