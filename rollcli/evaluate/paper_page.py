"""The page that shows the paper's tables and figures beside those of these maps."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rollcli import __version__
from rollcli.estimator.methods import LAMBDA0
from rollcli.evaluate.charts import METHOD_NAMES, SOLVER_NAMES, charts
from rollcli.evaluate.experiments import Findings
from rollcli.evaluate.options import PaperOptions
from rollcli.evaluate.tables import DELTAS_DEG, Table
from rollcli.evaluate.timing import Times
from rollcli.report.page import render_page

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
        lowest=_lowest(tables["fig3_lambda0"]),
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


def _lowest(table: Table) -> list[tuple[str, str, str]]:
    """Return delta, the fewest mean iterations and the rates with which every map takes them, those at 26."""
    lines = []
    for delta in DELTAS_DEG:
        on_all = table.where(delta_deg=delta, short=0)
        means = dict(zip(_numbers(on_all, "lambda0"), _numbers(on_all, "mean"), strict=True))
        best = min(means.values(), default=None)
        reach = [rate for rate, mean in means.items() if mean == best]
        fewest = "–" if best is None else f"{best:.2f} at λ(0) = {_spans(reach)}"
        lines.append((f"{delta:g}°", fewest, f"{means[LAMBDA0]:.2f}" if LAMBDA0 in means else "–"))
    return lines


def _spans(rates: Sequence[float]) -> str:
    """Return runs of whole numbers, such as "8–26, 30"."""
    runs: list[list[int]] = []
    for rate in map(int, rates):
        if runs and rate == runs[-1][1] + 1:
            runs[-1][1] = rate
        else:
            runs.append([rate, rate])
    return ", ".join(f"{first}" if first == last else f"{first}–{last}" for first, last in runs)


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
