"""`rollcli report`: a result to one HTML page, and its charts to files for slides."""

import contextlib
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from rollcli.errors import ExitStatus, InputError, UsageError
from rollcli.extras import require_extra
from rollcli.files.naming import listed
from rollcli.files.results import Result, read_result, run_path
from rollcli.files.stream import is_stream, write_output
from rollcli.report.chart import chart_names
from rollcli.report.options import ReportOptions
from rollcli.report.sources import Choice, Subject, choose, subjects
from rollcli.report.summary import frame_count
from rollcli.run.find import check_writes, list_files
from rollcli.run.options import EncodingOptions, FrameOptions
from rollcli.run.progress import Progress
from rollcli.run.record import recorded_options
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.in_order import Workers
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
    result = read_result(options.result)
    if not result.rows:
        raise InputError(f"{options.result}: has no rows: there is nothing to report")
    recorded = recorded_options(result.run, run_path(options.result))
    chosen = choose(result.rows, options.gallery if options.output is not None else 0)
    rows = [result.rows[each.place] for each in chosen]
    found = subjects(rows, options.result, options.images, recorded.images, fetch=options.fetch)
    reads = [
        options.result,
        *(path for each in found for path in (*each.frame.reads(), *each.images.values())),
    ]
    page = [] if options.output is None or is_stream(options.output) else [options.output]
    charts = [path for name in chart_names(result.rows) for path in options.chart_paths(name).values()]
    writes = [*charts, *page]
    check_writes(reads, writes, overwrite=options.running.overwrite)
    if options.running.dry_run:
        list_files([(reads, writes)])
        return ExitStatus.DONE
    return _write(options, result, chosen, found, recorded)


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
    result: Result,
    chosen: Sequence[Choice],
    found: Sequence[Subject],
    recorded: FrameOptions,
) -> ExitStatus:
    from rollcli.report.charts import all_charts
    from rollcli.report.content import report_page
    from rollcli.report.figures import chart_file
    from rollcli.rig.drive.assess import assess_rig

    progress = Progress(len(found), options.running, EncodingOptions())
    pictures = _take(found, recorded, options.running.jobs)
    if len(pictures) < len(found):
        progress.say("interrupted; nothing is written")
        return ExitStatus.INTERRUPTED
    rig = assess_rig(result.rows)
    charts = all_charts(result.rows, rig)
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
    page = report_page(result, options, list(zip(chosen, pictures, strict=True)), rig, charts)
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


def _take(found: Sequence[Subject], recorded: FrameOptions, jobs: int | None) -> "list[Pictures]":
    """Return the pictures of each subject, fewer when interrupted."""
    from rollcli.report.pictures import no_pictures, take_pictures

    work = Work(partial(take_pictures, options=recorded), no_pictures)
    with stop_on_signals() as stop, contextlib.closing(run_tasks(found, work, stop, Workers(jobs))) as taken:
        return list(taken)
