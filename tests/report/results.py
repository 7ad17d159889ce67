"""Results for reports to show."""

from pathlib import Path

from rollcli.files.results import Row, format_header, format_row

_OF_MAP = {"method": "gd", "alpha0": 20.0, "alpha1": 0.3, "alpha2": 0.0, "width": 160, "height": 120}


def row(
    name: str, roll: float | None = 1.0, width: float | None = 0.05, status: str = "ok", message: str = ""
) -> Row:
    """A row of a 160 x 120 map."""
    if roll is None:
        return Row(name, status="error", message=message or f"{name}: is empty")
    return Row(name, "", status, roll, width, message=message, **_OF_MAP)


def write_result(path: Path, rows, form="csv") -> None:
    """A result without a record of its run."""
    path.write_bytes(b"".join([format_header(form), *(format_row(each, form) for each in rows)]))


OF_ONE_KIND = (
    [row("a.png", 1.0, 0.1)],
    [row("a.png", 0.0, 0.0)] * 500,
    [row("a.png", None)] * 30,
    [row("a.png", 3.0, None, "suspect")],
    [row("a.png", 3.0, None)] * 3,
)
