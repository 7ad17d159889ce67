"""The paper's tables and figures as tables of numbers, each one CSV, and the page that shows them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rollcli import __version__
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.evaluate.options import PaperOptions
from rollcli.files.results import csv_table
from rollcli.report.page import render_page

if TYPE_CHECKING:
    from rollcli.report.figures import Drawing

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


_SHOWN = 50  # maps in the page's own list; the CSV has all


def paper_page(
    tables: Mapping[str, Table],
    charts: "Mapping[str, Drawing]",
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
        charts=charts,
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
