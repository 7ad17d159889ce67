"""The paper's tables and figures as charts."""

from collections.abc import Mapping
from typing import Any

from rollcli.estimator.methods import LAMBDA0
from rollcli.evaluate.tables import DELTAS_DEG, Table
from rollcli.report.charts.chart import Chart

SOLVER_NAMES = {"gd": "gradient descent", "gss": "golden section", "exact": "exact"}
METHOD_NAMES = {
    "gd": "parabola, all pixels",
    "line": "line, all pixels",
    "plane": "plane in one area",
    "areas": "planes in many areas",
    "auto": "road found first",
}
_COLOURS = {"gd": "@c1", "gss": "@c2", "exact": "@c3"}
_DEGREES = [f"{delta:g}°" for delta in DELTAS_DEG]
_DECADES = ("10 µs", "100 µs", "1 ms", "10 ms", "100 ms", "1 s", "10 s")
_DELTA_AXIS = {"title": {"text": "δ<sub>θ</sub>"}, "type": "category"}


def charts(tables: Mapping[str, Table]) -> dict[str, Chart]:
    """Return every chart of the page, by its name."""
    made = (
        _iterations(tables["table1_iterations"]),
        _runtime(tables["table2_runtime"]),
        _sweep(tables["fig3_lambda0"]),
        _solvers(tables["fig6_accuracy"]),
        _methods(tables["methods_accuracy"]),
    )
    return {chart.name: chart for chart in made}


def _error_axis(title: str) -> dict[str, Any]:
    return {"title": {"text": title}, "type": "log", "ticksuffix": "°", "exponentformat": "none", "dtick": 1}


def _line(name: str, x: Any, y: Any, colour: str, **more: Any) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": name,
        "x": x,
        "y": y,
        "line": {"color": colour, "width": 2},
        "marker": {"color": colour, "size": 8},
        **more,
    }


def _iterations(table: Table) -> Chart:
    data = []
    for solver in ("gss", "gd"):
        rows, colour, name = table.where(solver=solver), _COLOURS[solver], SOLVER_NAMES[solver]
        ours, paper = rows.column("mean"), rows.column("paper")
        data.append(_line(name, _DEGREES, ours, colour, hovertemplate="%{y:.2f} iterations"))
        circles = {
            "symbol": "circle-open",
            "size": 15,
            "color": colour,
            "line": {"width": 2, "color": colour},
        }
        data.append(
            _line(
                f"{name}, paper",
                _DEGREES,
                paper,
                colour,
                mode="markers",
                marker=circles,
                hovertemplate="%{y}",
            )
        )
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
    seconds = {
        "title": {"text": "run time"},
        "type": "log",
        "tickvals": list(decades),
        "ticktext": list(decades.values()),
    }
    label = "Run time of both solvers in three forms and in the paper, logarithmic"
    return Chart("runtime", label, data, {"yaxis": seconds})


def _sweep(table: Table) -> Chart:
    data = []
    for k, delta in enumerate(DELTAS_DEG):
        rows = table.where(delta_deg=delta)
        name = f"δ<sub>θ</sub> = {delta:g}°"
        more = {"mode": "lines", "hovertemplate": "λ(0) = %{x}: %{y:.2f} iterations"}
        data.append(_line(name, rows.column("lambda0"), rows.column("mean"), f"@c{k + 1}", **more))
    papers = {
        "type": "line",
        "x0": LAMBDA0,
        "x1": LAMBDA0,
        "y0": 0,
        "y1": 1,
        "yref": "paper",
        "line": {"color": "@muted", "width": 1, "dash": "dot"},
    }
    text = {
        "x": LAMBDA0,
        "y": 1,
        "yref": "paper",
        "text": "26",
        "showarrow": False,
        "xanchor": "left",
        "yanchor": "top",
        "font": {"color": "@muted"},
    }
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


def _methods(table: Table) -> Chart:
    names = [METHOD_NAMES[str(method)] for method in table.column("method")]
    figures = {
        "median_deg": ("median", "circle", "@c1"),
        "p95_deg": ("95th percentile", "diamond", "@c2"),
        "worst_deg": ("worst", "circle-open", "@c5"),
    }
    data = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "x": table.column(column),
            "y": names,
            "marker": {"symbol": symbol, "size": 12, "color": colour, "line": {"width": 2, "color": colour}},
            "hovertemplate": "%{x:.4f}°",
        }
        for column, (name, symbol, colour) in figures.items()
    ]
    return Chart(
        "methods",
        "Median, 95th percentile and worst error of five methods after known rotations",
        data,
        {"xaxis": _error_axis("|Δθ|"), "yaxis": {"autorange": "reversed"}},
    )
