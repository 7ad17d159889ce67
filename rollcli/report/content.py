"""What the page of a report shows, ready to be printed by its template."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from rollcli import __version__
from rollcli.errors import UsageError
from rollcli.files.results import Result, Row
from rollcli.files.stores.locations import public_name
from rollcli.messages import counted, listed
from rollcli.report import summary as said
from rollcli.report.charts import frame_axis, outside
from rollcli.report.figures import stills
from rollcli.report.options import ReportOptions
from rollcli.report.page import Chart, render_page, script_json
from rollcli.report.pictures import Pictures
from rollcli.rig import words
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.quantities import QUANTITIES
from rollcli.run.resume import recorded_calibrations, recorded_downscale, recorded_encodings
from rollcli.run.rig_gates import NOT_SEEN, Health, health_of


def report_page(
    result: Result,
    options: ReportOptions,
    shown: Sequence[tuple[tuple[int, str], Pictures]],
    rig: RigAssessment,
    charts: Mapping[str, Chart],
) -> bytes:
    """Return the page, HTML, UTF-8."""
    rows, run = result.rows, result.run or {}
    doubtful = sorted(
        ((number, row) for number, row in enumerate(rows, 1) if row.status != "ok"),
        key=lambda each: each[1].status,  # errors before suspects
    )
    return render_page(
        "rollcli.report",
        "report.html",
        *("page", "report", "frames"),
        title=options.title or f"Roll of {counted(len(rows), 'frame')}",
        result=listed(map(public_name, options.results)),
        page_version=__version__,
        said=said,
        words=words,
        rig=rig,
        frames=rows,
        run=run,
        summary=said.summarize(rows),
        written=max(map(said.written_at, options.results)),
        encodings=", ".join(recorded_encodings(run)),
        charts={name: replace(chart, still=stills(chart)) for name, chart in charts.items()},
        answer=words.answer(rig.now()).replace("-", "−"),
        quantities=QUANTITIES,
        health=_health(rig, run),
        not_seen=NOT_SEEN,
        outside=outside(rows),
        doubtful=doubtful,
        rows=_table(rows, rig),
        gallery=[(place + 1, rows[place], reason, pictures) for (place, reason), pictures in shown],
        angled=counted(sum(row.roll_deg is not None for row in rows), "frame"),
    )


def _health(rig: RigAssessment, run: Mapping[str, Any]) -> Health | None:
    calibration = next(iter(recorded_calibrations(run)), None)
    downscale = recorded_downscale(run, "the result's record")
    try:
        return health_of(rig, calibration, downscale)
    except UsageError:  # where frames have their own, the first may be of another size than the last drive
        return health_of(rig)


def _table(rows: Sequence[Row], rig: RigAssessment) -> str:
    """Return what a script reads of each frame: number, file, status, roll, roll in words, reason.

    `places` is where they stand along charts; None: at their numbers.
    """
    lines = [
        (
            number,
            row.file.encode("utf-8", "replace").decode(),
            "failed" if row.status == "error" else row.status,
            row.roll_deg,
            said.with_interval(row.roll_deg, row.roll_ci95_deg),
            row.message,
        )
        for number, row in enumerate(rows, 1)
    ]
    axis = frame_axis(rows, rig)
    return script_json({"rows": lines, "places": axis.places if axis.unit else None})
