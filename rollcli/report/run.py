"""`rollcli report`: a result to one HTML page, and its charts to files for slides."""

import contextlib
from collections.abc import Mapping, Sequence

from rollcli.errors import ExitStatus, UsageError
from rollcli.extras import require_extra
from rollcli.files.naming import natural_key
from rollcli.files.results import Result, read_result
from rollcli.files.storage import is_stream, write_output
from rollcli.messages import counted, listed, say
from rollcli.report.charts import all_charts
from rollcli.report.options import ReportOptions
from rollcli.report.page import Chart
from rollcli.report.pictures import Pictures, take_pictures
from rollcli.report.sources import Subject, choose, subjects
from rollcli.report.summary import common_run
from rollcli.rig.drive.assess import RigAssessment, assess_rig
from rollcli.run.outputs import check_named_once, listed_only
from rollcli.run.rig import order_of, require_rows, unfinished
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import run_tasks

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
    check_named_once(options.results)
    parts = [read_result(path) for path in options.results]
    require_rows(parts, "report")
    # all rows in the order of the run, or one result after the other; a shard alone may be shown
    owned = [(number, row) for number, part in enumerate(parts) for row in part.rows]
    origins = list[str]()
    if len(parts) > 1:
        order, origins = order_of(parts)
        owned = [owned[place] for place in order]
    rows = tuple(row for _, row in owned)
    rig = assess_rig(rows, origins=origins)
    jumps = {
        int(drive.frames[jump.frame])
        for drive in rig.drives
        for found in drive.quantities.values()
        for jump in found.jumps
    }
    chosen = choose(rows, options.gallery if options.output is not None else 0, sorted(jumps))
    found = subjects([owned[place] for place in chosen], parts, options.images, fetch=options.fetch)
    reads = [path for each in found for path in (*each.frame.reads(), *each.images.values())]
    page = [] if options.output is None or is_stream(options.output) else [options.output]
    charts = all_charts(rows, rig)
    writes = [*(path for name in charts for path in options.chart_paths(name).values()), *page]
    if listed_only(lambda: [([*options.results, *reads], writes)], options.running):
        return ExitStatus.DONE
    result = Result(rows, common_run([part.run for part in parts]))
    if missing := unfinished(parts):
        options.running.note(missing)
    return _write(options, result, chosen, found, rig, charts)


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
    chosen: Mapping[int, str],
    found: Sequence[Subject],
    rig: RigAssessment,
    charts: Mapping[str, Chart],
) -> ExitStatus:
    from rollcli.report.content import report_page
    from rollcli.report.figures import chart_file

    pictures = _take(found, options.running.jobs)
    if len(pictures) < len(found):
        say("interrupted; nothing is written")
        return ExitStatus.INTERRUPTED
    files = {
        path: chart_file(chart, kind)
        for name, chart in charts.items()
        for kind, path in options.chart_paths(name).items()
    }
    for path, data in files.items():
        write_output(path, data, overwrite=options.running.overwrite)
    if files:
        options.running.note(f"{listed(list(files))}: written")
    if options.output is None:
        return ExitStatus.DONE
    page = report_page(result, options, list(zip(chosen.items(), pictures, strict=True)), rig, charts)
    write_output(options.output, page, overwrite=options.running.overwrite)
    missing = [each.missing for each in pictures if not each.made]
    for reason in missing[:_REASONS]:
        say(f"no picture of {reason}")
    if missing:
        say(
            f"{len(missing)} of {counted(len(pictures), 'frame')} without pictures: run where estimate ran, "
            "name what it wrote with --images, or leave pictures out with --gallery 0"
        )
    shown = len(pictures) - len(missing)
    options.running.note(f"{options.output}: pictures of {counted(shown, 'frame')}, {len(page) / 1e6:.1f} MB")
    return ExitStatus.FRAMES_FAILED if missing else ExitStatus.DONE


def _take(found: Sequence[Subject], jobs: int | None) -> list[Pictures]:
    """Return the pictures of each subject, fewer when interrupted."""
    # as a video is decoded
    places = sorted(range(len(found)), key=lambda place: natural_key(found[place].frame.file))
    work = Work(take_pictures, lambda _, reason: Pictures({}, reason))
    with stop_on_signals() as stop:
        tasks = run_tasks([found[place] for place in places], work, stop, Workers(jobs))
        with contextlib.closing(tasks) as taken:
            pictures = dict(zip(places, taken, strict=False))
    return [pictures[place] for place in sorted(pictures)]
