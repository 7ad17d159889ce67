"""The paper's tables and figures as tables of numbers, over all maps; each is one CSV."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, METHODS, SOLVERS, Findings, Times
from rollcli.files.results import csv_table

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
