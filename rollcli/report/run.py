"""`rollcli report`: a result to one HTML page, and its charts to files for slides."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rollcli.errors import ExitStatus, InputError, UsageError
from rollcli.extras import require_extra
from rollcli.files.naming import listed, natural_key
from rollcli.files.results import Result, Row, read_result, run_path
from rollcli.files.stream import is_stream, write_output
from rollcli.report.charts import all_charts
from rollcli.report.options import ReportOptions
from rollcli.report.page import Chart
from rollcli.report.sources import Choice, Subject, choose, subjects
from rollcli.report.summary import common_run, frame_count
from rollcli.rig.drive.assess import RigAssessment, assess_rig
from rollcli.run.options import EncodingOptions
from rollcli.run.outputs import listed_only
from rollcli.run.progress import Progress
from rollcli.run.resume import recorded_options
from rollcli.run.rig import order_of, origins_of
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import run_tasks

if TYPE_CHECKING:
    from rollcli.report.pictures import Pictures

_REASONS = 3  # how many are told


def run_report(options: ReportOptions) -> ExitStatus:
    """Write the page and the charts that are asked for.

    Parameters
    ----------
    options : ReportOptions

    Returns
    -------
    ExitStatus
        FRAMES_FAILED when pictures are missing, INTERRUPTED when interrupted.

    Raises
    ------
    UsageError, InputError
        Exit status 2.
    OutputError
        Exit status 1.
    """
    if options.output is None:
        _require_charts_alone(options)
    require_extra("report", "the page")
    if len(set(options.results)) < len(options.results):
        raise UsageError(f"{listed(options.results)}: a result is named twice")
    joined = _joined(options.results)
    rig = assess_rig(joined.rows, origins=joined.origins)
    jumps = [
        int(drive.frames[jump.frame])
        for drive in rig.drives
        for found in drive.quantities.values()
        for jump in found.jumps
    ]
    chosen = choose(joined.rows, options.gallery if options.output is not None else 0, sorted({*jumps}))
    found = _subjects(joined, chosen, options)
    reads = [
        *options.results,
        *(path for each in found for path in (*each.frame.reads(), *each.images.values())),
    ]
    page = [] if options.output is None or is_stream(options.output) else [options.output]
    charts = all_charts(joined.rows, rig)
    writes = [*(path for name in charts for path in options.chart_paths(name).values()), *page]
    if listed_only(reads, writes, options.running):
        return ExitStatus.DONE
    return _write(options, joined, chosen, found, rig, charts)


def _require_charts_alone(options: ReportOptions) -> None:
    """Refuse to write nothing, and what is for a page alone."""
    if not options.chart_paths(""):
        raise UsageError(
            "nothing to write: name a page with -o, or a folder for charts with --svg, --pdf or --png"
        )
    if options.images is not None or options.title is not None:
        name = "--title" if options.images is None else "--images"
        raise UsageError(f"{name} is for a page: name one with -o")


def _write(
    options: ReportOptions,
    joined: "_Joined",
    chosen: Sequence[Choice],
    found: Sequence[Subject],
    rig: RigAssessment,
    charts: Mapping[str, Chart],
) -> ExitStatus:
    from rollcli.report.content import report_page
    from rollcli.report.figures import chart_file

    progress = Progress(len(found), options.running, EncodingOptions())
    pictures = _take(found, options.running.jobs)
    if len(pictures) < len(found):
        progress.say("interrupted; nothing is written")
        return ExitStatus.INTERRUPTED
    files = {
        path: chart_file(chart, kind)
        for name, chart in charts.items()
        for kind, path in options.chart_paths(name).items()
    }
    for path, data in files.items():
        write_output(path, data, overwrite=options.running.overwrite)
    if files:
        progress.note(f"{listed(list(files))}: written")
    if options.output is None:
        return ExitStatus.DONE
    page = report_page(
        Result(joined.rows, joined.run), options, list(zip(chosen, pictures, strict=True)), rig, charts
    )
    write_output(options.output, page, overwrite=options.running.overwrite)
    missing = [each.missing for each in pictures if each.empty]
    for reason in missing[:_REASONS]:
        progress.say(f"no picture of {reason}")
    if missing:
        progress.say(
            f"{len(missing)} of {frame_count(len(pictures))} without pictures: run where estimate ran, name "
            "what it wrote with --images, or leave pictures out with --gallery 0"
        )
    shown = len(pictures) - len(missing)
    progress.note(f"{options.output}: pictures of {frame_count(shown)}, {len(page) / 1e6:.1f} MB")
    return ExitStatus.FRAMES_FAILED if missing else ExitStatus.DONE


def _take(found: Sequence[Subject], jobs: int | None) -> "list[Pictures]":
    """Return the pictures of each subject, fewer when interrupted."""
    from rollcli.report.pictures import no_pictures, take_pictures

    names = [each.frame.file for each in found]
    places = sorted(range(len(names)), key=lambda place: natural_key(names[place]))  # as a video is decoded
    work = Work(take_pictures, no_pictures)
    with stop_on_signals() as stop:
        tasks = run_tasks([found[place] for place in places], work, stop, Workers(jobs))
        with contextlib.closing(tasks) as taken:
            pictures = dict(zip(places, taken, strict=False))
    return [pictures[place] for place in sorted(pictures)]


@dataclass(frozen=True, slots=True)
class _Joined:
    """All rows in the order of the run, or one result after the other.

    `owners` are the parts that the rows are of.
    """

    parts: Sequence[Result]
    rows: tuple[Row, ...]
    owners: Sequence[int]
    origins: Sequence[str]
    run: Mapping[str, Any] | None


def _joined(paths: Sequence[str]) -> _Joined:
    parts = list[Result]()
    for path in paths:
        parts.append(read_result(path))
        if not parts[-1].rows:
            raise InputError(f"{path}: has no rows: there is nothing to report")
    rows = [row for part in parts for row in part.rows]
    owners = [number for number, part in enumerate(parts) for _ in part.rows]
    order = order_of(parts).tolist() if len(parts) > 1 else range(len(rows))  # a shard alone may be shown
    return _Joined(
        parts,
        tuple(rows[place] for place in order),
        [owners[place] for place in order],
        origins_of(parts),
        common_run([part.run for part in parts]),
    )


def _subjects(joined: _Joined, chosen: Sequence[Choice], options: ReportOptions) -> list[Subject]:
    """Find the files of the frames to show, each from where its own result lies."""
    found: dict[int, Subject] = {}
    for number, part in enumerate(joined.parts):
        made = recorded_options(part.run, run_path(part.path))
        places = [each.place for each in chosen if joined.owners[each.place] == number]
        rows = [joined.rows[place] for place in places]
        if rows or len(joined.parts) == 1:
            of_part = subjects(rows, part.path, options.images, made, fetch=options.fetch)
            found |= dict(zip(places, of_part, strict=True))
    return [found[each.place] for each in chosen]
