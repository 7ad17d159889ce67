"""An accuracy as a table to read, as CSV, and as JSON."""

import csv
import io
import json
from dataclasses import fields
from typing import Any

from rollcli.evaluate.accuracy import LARGE_ERROR_DEG, Accuracy
from rollcli.evaluate.pose_accuracy import PoseAccuracy

_NAMES = {"no_angle", "no_truth"}
_DIGITS = 6
_LENGTHS = {"median", "p95", "worst", "bias"}  # what has the unit of the quantity


def as_table(accuracy: Accuracy) -> str:
    """Return one figure a line, for people."""
    of = accuracy.count
    lines = [
        ("frames compared", f"{of}" + (f" ({accuracy.suspect} suspect)" if accuracy.suspect else "")),
        ("without an angle", str(len(accuracy.no_angle))),
        ("without a known angle", str(len(accuracy.no_truth))),
        ("median error", _degrees(accuracy.median_deg)),
        ("95th percentile", _degrees(accuracy.p95_deg)),
        ("worst", _degrees(accuracy.worst_deg) + (f"  {accuracy.worst_file}" if of else "")),
        ("mean, signed", _degrees(accuracy.bias_deg)),
        (f"above {LARGE_ERROR_DEG:g} degrees", _percent(accuracy.share_above_0_5_deg, of)),
        ("inside the 95 % interval", _percent(accuracy.coverage_95, accuracy.intervals)),
    ]
    for name, part, unit in (("pitch", accuracy.pitch, "degrees"), ("height", accuracy.height, "m")):
        if part is not None:
            lines += [
                (f"{name}, frames compared", str(part.count)),
                (f"{name}, median error", f"{part.median:.4f} {unit}"),
                (f"{name}, 95th percentile", f"{part.p95:.4f} {unit}"),
                (f"{name}, worst", f"{part.worst:.4f} {unit}"),
                (f"{name}, mean, signed", f"{part.bias:.4f} {unit}"),
                (f"{name}, in its interval", _percent(part.coverage_95, part.count)),
            ]
    return "".join(f"{name:26}{value}\n" for name, value in lines)


def as_csv(accuracy: Accuracy) -> str:
    """Return a header and one line."""
    buffer = io.StringIO()
    values = _values(accuracy)
    lines = csv.writer(buffer, lineterminator="\n")
    lines.writerow(values)
    lines.writerow(len(value) if name in _NAMES else value for name, value in values.items())
    return buffer.getvalue()


def as_json(accuracy: Accuracy) -> str:
    """Return one object; the frames without an angle or a known one by name."""
    return json.dumps(_values(accuracy), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _values(accuracy: Accuracy) -> dict[str, Any]:
    values = {field.name: getattr(accuracy, field.name) for field in fields(accuracy)}
    for name, unit in (("pitch", "deg"), ("height", "m")):
        part = values.pop(name)
        for field in fields(PoseAccuracy):
            suffix = f"_{unit}" if field.name in _LENGTHS else ""
            values[f"{name}_{field.name}{suffix}"] = getattr(part, field.name, None)
    return {name: round(v, _DIGITS) if isinstance(v, float) else v for name, v in values.items()}


def _degrees(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f} degrees"


def _percent(share: float | None, of: int) -> str:
    return "-" if share is None else f"{100 * share:.1f} % ({round(share * of)} of {of})"
