"""The paper's tables and figures as tables of numbers, each one CSV."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rollcli.estimator.request import SOLVERS
from rollcli.evaluate.experiments import DELTAS, FORMS, LAMBDAS, Findings, Times
from rollcli.files.results import Row, csv_table

Value = str | int | float | None
Line = dict[str, Value]
Table = list[Line]  # of the same columns

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


def table_csv(table: Table) -> bytes:
    """Return a table as CSV: whole names, floats with seven digits, nothing where there is no value."""
    return csv_table([table[0], *([_text(name, value) for name, value in row.items()] for row in table)])


def _text(column: str, value: Value) -> Value:
    if isinstance(value, float):
        return f"{value:.7g}"
    return _WHOLE_NAMES.get(column, {}).get(str(value), value)


def column(table: Table, name: str, **of: Value) -> list[Any]:
    """Return one column, from top to bottom, of the rows that have these values."""
    return [row[name] for row in table if of.items() <= row.items()]


def maps_table(found: Sequence[Findings], failed: Sequence[Row]) -> Iterator[Line]:
    """Yield each map: its angle, and the iterations on it; of one that failed the reason."""
    for each in found:
        row: Line = {name: getattr(each, name) for name in ("file", "width", "height", "pixels")}
        row["theta_deg"] = math.degrees(each.theta)
        for solver in PAPER_ITERATIONS:
            name = SOLVER_NAMES[solver].replace(" ", "_")
            row |= zip((f"{name}_{delta:g}" for delta in DELTAS_DEG), getattr(each, solver), strict=True)
        row["message"] = ""
        yield row
    for lost in failed:
        yield {**dict.fromkeys(row), "file": lost.file, "message": lost.message}


def iterations_table(found: Sequence[Findings]) -> Iterator[Line]:
    """Yield Table I: iterations of both solvers for each delta."""
    for solver, papers in PAPER_ITERATIONS.items():
        for k, delta in enumerate(DELTAS):
            row: Line = {"solver": solver, "delta_deg": DELTAS_DEG[k], "delta_rad": delta, "paper": papers[k]}
            yield {**row, **_spread([getattr(each, solver)[k] for each in found])}


def _spread(counts: Sequence[int]) -> Line:
    known = (float(np.mean(counts)), min(counts), max(counts)) if counts else (None, None, None)
    return dict(zip(("mean", "min", "max", "maps"), (*known, len(counts)), strict=True))


def runtime_table(times: Sequence[Times]) -> Iterator[Line]:
    """Yield Table II: mean run time of both solvers in three forms, seconds."""
    for solver, papers in PAPER_SECONDS.items():
        for k, paper in enumerate(papers):
            row: Line = {"solver": solver, "delta_deg": DELTAS_DEG[k], "paper_s": paper}
            means = {
                f"{form}_s": float(np.mean([each.seconds[solver, form][k] for each in times]))
                for form in FORMS
            }
            ratio = means["textbook_s"] / means["moments_s"]
            yield {**row, **means, "textbook_over_moments": ratio, "maps": len(times)}


def sweep_table(found: Sequence[Findings]) -> Iterator[Line]:
    """Yield Fig. 3: iterations of gd against the first learning rate, for each delta.

    Over the maps on which it ended within delta of a minimum; `short` counts the others.
    """
    for d, delta_deg in enumerate(DELTAS_DEG):
        for k, rate in enumerate(LAMBDAS):
            counts = [count for each in found if (count := each.sweep[d][k]) is not None]
            row = {"lambda0": rate, "delta_deg": delta_deg, **_spread(counts)}
            yield {**row, "short": len(found) - len(counts)}


def solvers_table(found: Sequence[Findings]) -> Iterator[Line]:
    """Yield Fig. 6: errors of the three solvers after known rotations, for each delta."""
    for solver in SOLVERS:
        for k, delta_deg in enumerate(DELTAS_DEG):
            errors = [turn[k] for each in found for turn in each.solver_errors[solver]]
            yield {"solver": solver, "delta_deg": delta_deg, **_errors(errors)}


def methods_table(found: Sequence[Findings]) -> Iterator[Line]:
    """Yield the errors of our other methods after the same rotations."""
    for method in METHOD_NAMES:
        errors = [error for each in found for error in each.method_errors[method]]
        known = [error for error in errors if error is not None]
        yield {"method": method, **_errors(known), "no_angle": len(errors) - len(known)}


def _errors(errors: Sequence[float]) -> Line:
    """Return mean, median, 95th percentile and largest, degrees; then how many there are."""
    names = ("mean_deg", "median_deg", "p95_deg", "worst_deg")
    if not errors:
        return {**dict.fromkeys(names), "estimates": 0}
    sizes = np.degrees(errors)
    figures = sizes.mean(), np.median(sizes), np.percentile(sizes, 95), sizes.max()
    return {**dict(zip(names, map(float, figures), strict=True)), "estimates": len(errors)}


def all_tables(found: Sequence[Findings], failed: Sequence[Row], times: Sequence[Times]) -> dict[str, Table]:
    """Return every table by the name of its file, without the ending."""
    tables = {
        "maps": maps_table(found, failed),
        "table1_iterations": iterations_table(found),
        "table2_runtime": runtime_table(times),
        "fig3_lambda0": sweep_table(found),
        "fig6_accuracy": solvers_table(found),
        "methods_accuracy": methods_table(found),
    }
    return {name: list(table) for name, table in tables.items()}
