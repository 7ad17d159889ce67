"""The paper's tables and figures as tables of numbers, each one CSV, and the page that shows them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rollcli import __version__
from rollcli.estimator.request import LAMBDA0
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.evaluate.options import PaperOptions
from rollcli.files.results import csv_table
from rollcli.report.page import Chart, render_page, scatter

Value = str | int | float | None

DELTAS_DEG = (0.1, 0.01, 0.001, 0.0001)
# [GD] Tables I and II
PAPER_ITERATIONS = {"gss": (16, 21, 26, 30), "gd": (3, 4, 4, 4)}
PAPER_SECONDS = {"gss": (1.551, 1.986, 2.457, 2.810), "gd": (0.412, 0.401, 0.511, 0.512)}
SOLVER_NAMES = {"gd": "gradient descent", "gss": "golden section", "exact": "exact"}
METHOD_NAMES = {
    "gd": "parabola, all pixels",
    "line": "line, all pixels",
    "plane": "plane in one area",
    "areas": "planes in many areas",
    "auto": "road found first",
}
_WHOLE_NAMES = {"solver": SOLVER_NAMES, "method": METHOD_NAMES}


@dataclass(frozen=True)
class Table:
    """A table of numbers.

    Attributes
    ----------
    name : str
        Of its file, without the ending.
    columns : tuple of str
    rows : tuple of tuple
    """

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    def csv(self) -> bytes:
        """Return the table as CSV: whole names, floats with seven digits, nothing where there is no value."""
        names = [_WHOLE_NAMES.get(column, {}) for column in self.columns]
        rows = (
            [each.get(text := _text(value), text) for each, value in zip(names, row, strict=True)]
            for row in self.rows
        )
        return csv_table([self.columns, *rows])

    def column(self, name: str) -> list[Value]:
        """Return one column, from top to bottom."""
        place = self.columns.index(name)
        return [row[place] for row in self.rows]

    def where(self, **values: Value) -> "Table":
        """Return the rows that have these values."""
        places = {self.columns.index(name): value for name, value in values.items()}
        rows = tuple(row for row in self.rows if all(row[at] == value for at, value in places.items()))
        return Table(self.name, self.columns, rows)


def maps_table(found: Sequence[Findings], failed: Sequence[tuple[str, str]]) -> Table:
    """Return each map: its angle, and the iterations on it."""
    counts = [
        f"{SOLVER_NAMES[solver].replace(' ', '_')}_{delta:g}"
        for solver in ("gss", "gd")
        for delta in DELTAS_DEG
    ]
    columns = ("file", "width", "height", "pixels", "theta_deg", *counts, "message")
    rows: list[tuple[Value, ...]] = [
        (each.file, each.width, each.height, each.pixels, math.degrees(each.theta), *each.gss, *each.gd, "")
        for each in found
    ]
    missing = (None,) * (len(columns) - 2)
    rows += [(name, *missing, reason) for name, reason in failed]
    return Table("maps", columns, tuple(rows))


def iterations_table(found: Sequence[Findings]) -> Table:
    """Return Table I: iterations of both solvers for each delta."""
    columns = ("solver", "delta_deg", "delta_rad", "paper", "mean", "min", "max", "maps")
    rows = []
    for solver in ("gss", "gd"):
        for k, delta in enumerate(DELTAS):
            counts = [getattr(each, solver)[k] for each in found]
            mean = float(np.mean(counts))
            paper = PAPER_ITERATIONS[solver][k]
            rows.append((solver, DELTAS_DEG[k], delta, paper, mean, min(counts), max(counts), len(counts)))
    return Table("table1_iterations", columns, tuple(rows))


def runtime_table(times: Sequence[Times]) -> Table:
    """Return Table II: mean run time of both solvers in three forms, seconds."""
    columns = (
        "solver",
        "delta_deg",
        "paper_s",
        *(f"{form}_s" for form in FORMS),
        "textbook_over_moments",
        "maps",
    )
    rows = []
    for solver in ("gss", "gd"):
        for k, delta_deg in enumerate(DELTAS_DEG):
            means = [float(np.mean([each.seconds[solver, form][k] for each in times])) for form in FORMS]
            ratio = means[-1] / means[0]
            rows.append((solver, delta_deg, PAPER_SECONDS[solver][k], *means, ratio, len(times)))
    return Table("table2_runtime", columns, tuple(rows))


def sweep_table(found: Sequence[Findings]) -> Table:
    """Return Fig. 3: iterations of gd against the first learning rate, for each delta.

    Over the maps on which it ended within delta of a minimum; `short` counts the others.
    """
    rows: list[tuple[Value, ...]] = []
    for d, delta_deg in enumerate(DELTAS_DEG):
        for k, rate in enumerate(LAMBDAS):
            counts = [count for each in found if (count := each.sweep[d][k]) is not None]
            spread = (float(np.mean(counts)), min(counts), max(counts)) if counts else (None, None, None)
            rows.append((rate, delta_deg, *spread, len(counts), len(found) - len(counts)))
    columns = ("lambda0", "delta_deg", "mean", "min", "max", "maps", "short")
    return Table("fig3_lambda0", columns, tuple(rows))


_ERRORS = ("mean_deg", "median_deg", "p95_deg", "worst_deg", "estimates")


def solvers_table(found: Sequence[Findings]) -> Table:
    """Return Fig. 6: errors of the three solvers after known rotations, for each delta."""
    rows = tuple(
        (solver, DELTAS_DEG[k], *_errors(turn[k] for each in found for turn in each.solver_errors[solver]))
        for solver in SOLVERS
        for k in range(len(DELTAS))
    )
    return Table("fig6_accuracy", ("solver", "delta_deg", *_ERRORS), rows)


def methods_table(found: Sequence[Findings]) -> Table:
    """Return the errors of our other methods after the same rotations."""
    rows = []
    for method in METHODS:
        errors = [error for each in found for error in each.method_errors[method]]
        known = [error for error in errors if error is not None]
        rows.append((method, *_errors(known), len(errors) - len(known)))
    return Table("methods_accuracy", ("method", *_ERRORS, "no_angle"), tuple(rows))


def _errors(errors: Iterable[float]) -> tuple[float | int | None, ...]:
    """Return mean, median, 95th percentile and largest, degrees; then how many there are."""
    sizes = np.degrees(np.array(list(errors)))
    if not len(sizes):
        return None, None, None, None, 0
    figures = (sizes.mean(), np.median(sizes), np.percentile(sizes, 95), sizes.max())
    return (*map(float, figures), len(sizes))


def _text(value: Value) -> str:
    if value is None:
        return ""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def all_tables(
    found: Sequence[Findings], failed: Sequence[tuple[str, str]], times: Sequence[Times]
) -> dict[str, Table]:
    """Return every table by its name."""
    tables = (
        maps_table(found, failed),
        iterations_table(found),
        runtime_table(times),
        sweep_table(found),
        solvers_table(found),
        methods_table(found),
    )
    return {table.name: table for table in tables}


_COLOURS = {"gd": "@c1", "gss": "@c2", "exact": "@c3"}
_DEGREES = [f"{delta:g}°" for delta in DELTAS_DEG]
_DECADES = ("10 µs", "100 µs", "1 ms", "10 ms", "100 ms", "1 s", "10 s")
_DELTA_AXIS = {"title": {"text": "δ<sub>θ</sub>"}, "type": "category"}


def charts(tables: Mapping[str, Table]) -> dict[str, Chart]:
    """Return every chart of the page, by its name."""
    made = (
        _iterations_chart(tables["table1_iterations"]),
        _runtime(tables["table2_runtime"]),
        _sweep(tables["fig3_lambda0"]),
        _solvers(tables["fig6_accuracy"]),
        _methods_chart(tables["methods_accuracy"]),
    )
    return {chart.name: chart for chart in made}


def _error_axis(title: str) -> dict[str, Any]:
    return {"title": {"text": title}, "type": "log", "ticksuffix": "°", "exponentformat": "none", "dtick": 1}


def _line(name: str, x: Any, y: Any, colour: str, **more: Any) -> dict[str, Any]:
    look = {"line": {"color": colour, "width": 2}, "marker": {"color": colour, "size": 8}}
    return scatter(name, "lines+markers", x, y, **look) | more


def _mark(colour: str, size: int, symbol: str) -> dict[str, Any]:
    return {"symbol": symbol, "size": size, "color": colour, "line": {"width": 2, "color": colour}}


def _iterations_chart(table: Table) -> Chart:
    data = []
    for solver in ("gss", "gd"):
        rows, colour, name = table.where(solver=solver), _COLOURS[solver], SOLVER_NAMES[solver]
        ours, paper = rows.column("mean"), rows.column("paper")
        data.append(_line(name, _DEGREES, ours, colour, hovertemplate="%{y:.2f} iterations"))
        circles = {"mode": "markers", "marker": _mark(colour, 15, "circle-open"), "hovertemplate": "%{y}"}
        data.append(_line(f"{name}, paper", _DEGREES, paper, colour, **circles))
    layout = {"xaxis": _DELTA_AXIS, "yaxis": {"title": {"text": "iterations"}, "rangemode": "tozero"}}
    return Chart(
        "iterations", "Iterations of both solvers against the tolerance, beside the paper's", data, layout
    )


def _runtime(table: Table) -> Chart:
    forms = {
        "paper_s": ("paper (Matlab)", "@c6"),
        "textbook_s": ("n × 3 form", "@c4"),
        "with_pass_s": ("moments, with the pass over the map", "@c3"),
        "moments_s": ("moments", "@c1"),
    }
    data = []
    for column, (name, colour) in forms.items():
        for solver in ("gss", "gd"):
            where = [[SOLVER_NAMES[solver]] * len(_DEGREES), _DEGREES]
            more = {"legendgroup": name, "showlegend": solver == "gss", "hovertemplate": "%{y:.3s}s"}
            data.append(_line(name, where, table.where(solver=solver).column(column), colour, **more))
    decades = {10.0**k: text for k, text in zip(range(-5, 2), _DECADES, strict=True)}
    ticks = {"tickvals": list(decades), "ticktext": list(decades.values())}
    seconds = {"title": {"text": "run time"}, "type": "log", **ticks}
    label = "Run time of both solvers in three forms and in the paper, logarithmic"
    return Chart("runtime", label, data, {"yaxis": seconds})


def _sweep(table: Table) -> Chart:
    data = []
    for k, delta in enumerate(DELTAS_DEG):
        rows = table.where(delta_deg=delta)
        name = f"δ<sub>θ</sub> = {delta:g}°"
        more = {"mode": "lines", "hovertemplate": "λ(0) = %{x}: %{y:.2f} iterations"}
        data.append(_line(name, rows.column("lambda0"), rows.column("mean"), f"@c{k + 1}", **more))
    dots = {"color": "@muted", "width": 1, "dash": "dot"}
    ends = {"x0": LAMBDA0, "x1": LAMBDA0, "y0": 0, "y1": 1, "yref": "paper"}
    papers = {"type": "line", **ends, "line": dots}
    place = {"x": LAMBDA0, "y": 0, "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    text = {**place, "text": "26", "showarrow": False, "font": {"color": "@muted"}}
    layout = {
        "xaxis": {"title": {"text": "λ(0)"}, "range": [0, 101]},
        "yaxis": {"title": {"text": "iterations, mean over the maps"}, "rangemode": "tozero"},
        "shapes": [papers],
        "annotations": [text],
    }
    return Chart("lambda0", "Iterations of gradient descent against the first learning rate", data, layout)


def _solvers(table: Table) -> Chart:
    data = []
    for solver, name in SOLVER_NAMES.items():
        rows = table.where(solver=solver)
        # two of them often coincide: the last is drawn open, around the other
        marker = {"symbol": "circle-open", "size": 15, "color": _COLOURS[solver]} if solver == "exact" else {}
        more = {"hovertemplate": "%{y:.5f}°"} | ({"marker": marker} if marker else {})
        data.append(_line(name, _DEGREES, rows.column("mean_deg"), _COLOURS[solver], **more))
    layout = {"xaxis": _DELTA_AXIS, "yaxis": _error_axis("mean |Δθ|")}
    return Chart(
        "accuracy", "Mean error of three solvers after known rotations, against the tolerance", data, layout
    )


def _methods_chart(table: Table) -> Chart:
    names = [METHOD_NAMES[str(method)] for method in table.column("method")]
    figures = {
        "median_deg": ("median", "circle", "@c1"),
        "p95_deg": ("95th percentile", "diamond", "@c2"),
        "worst_deg": ("worst", "circle-open", "@c5"),
    }
    hover = {"hovertemplate": "%{x:.4f}°"}
    data = [
        scatter(name, "markers", table.column(column), names, marker=_mark(colour, 12, symbol), **hover)
        for column, (name, symbol, colour) in figures.items()
    ]
    layout = {"xaxis": _error_axis("|Δθ|"), "yaxis": {"autorange": "reversed"}}
    label = "Median, 95th percentile and worst error of five methods after known rotations"
    return Chart("methods", label, data, layout)


_SHOWN = 50  # maps in the page's own list; the CSV has all


def paper_page(
    tables: Mapping[str, Table],
    found: Sequence[Findings],
    failed: Sequence[tuple[str, str]],
    times: Sequence[Times],
    options: PaperOptions,
) -> bytes:
    """Return the page, HTML."""
    return render_page(
        "rollcli.evaluate",
        "paper.html",
        title=f"The paper's experiments on {_count(len(found), 'map')}",
        version=__version__,
        deltas=[f"{delta:g}°" for delta in DELTAS_DEG],
        charts=charts(tables),
        iterations=_iterations(tables["table1_iterations"]),
        runtimes=_runtimes(tables["table2_runtime"]),
        methods=_methods(tables["methods_accuracy"]),
        maps=[_map(each) for each in found[:_SHOWN]],
        more_maps=max(0, len(found) - _SHOWN),
        failed=failed,
        timed=_count(len(times), "map"),
        timed_pixels=f"{np.mean([each.pixels for each in times]):,.0f}",
        ratio=f"{min(_numbers(tables['table2_runtime'], 'textbook_over_moments')):,.0f}",
        turns=_turns(options),
        truth=options.experiments.truth,
        region=options.has_region,
    )


def _turns(options: PaperOptions) -> str:
    angles, step = options.experiments.turns_deg, options.experiments.turns[2]
    if len(angles) == 1:
        return _degrees(angles[0])
    return f"{_degrees(angles[0])} to {_degrees(angles[-1])} in steps of {_degrees(step)}"


def _degrees(angle: float, digits: str = "g") -> str:
    return f"{angle:{digits}}°".replace("-", "−")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _numbers(table: Table, column: str) -> list[float]:
    return [value for value in table.column(column) if isinstance(value, (int, float))]


def _iterations(table: Table) -> list[tuple[str, list[str], list[str]]]:
    """Return name, the paper's column and ours, for each solver."""
    lines = []
    for solver in ("gss", "gd"):
        rows = table.where(solver=solver)
        ours = [
            f"{mean:g}" if low == high else f"{mean:.2f} ({low}–{high})"
            for mean, low, high in zip(
                *(_numbers(rows, name) for name in ("mean", "min", "max")), strict=True
            )
        ]
        lines.append((SOLVER_NAMES[solver], [f"{count}" for count in rows.column("paper")], ours))
    return lines


def _runtimes(table: Table) -> list[tuple[str, str, list[str]]]:
    """Return solver, form, and a time for each delta."""
    forms = {
        "paper_s": "paper, Matlab 2019a on an i7-8700K",
        "textbook_s": "here, the paper's n × 3 form",
        "with_pass_s": "here, moments with the pass over the map",
        "moments_s": "here, moments alone",
    }
    return [
        (
            SOLVER_NAMES[solver],
            form,
            [_duration(each) for each in _numbers(table.where(solver=solver), column)],
        )
        for solver in ("gss", "gd")
        for column, form in forms.items()
    ]


def _methods(table: Table) -> list[tuple[str, ...]]:
    """Return name, mean, median, 95th percentile, worst, and how many rotated maps had no angle."""
    return [
        (
            METHOD_NAMES[str(method)],
            *("–" if value is None else f"{value:.5f}°" for value in figures),
            f"{missing}",
        )
        for method, *figures, _, missing in table.rows
    ]


def _map(found: Findings) -> dict[str, Any]:
    return {
        "file": found.file,
        "size": f"{found.width}×{found.height}",
        "valid": f"{100 * found.pixels / (found.width * found.height):.0f} %",
        "theta": _degrees(math.degrees(found.theta), ".4f"),
        "gss": " ".join(map(str, found.gss)),
        "gd": " ".join(map(str, found.gd)),
    }


def _duration(seconds: float) -> str:
    """Return three digits, in the unit that suits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} µs"
