"""`evaluate paper` from the command line: maps to workers, their findings to tables and one page."""

import contextlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from rollcli.errors import ExitStatus, UsageError
from rollcli.evaluate.options import PaperOptions
from rollcli.evaluate.truth import KnownPose, read_truth
from rollcli.extras import require_extra
from rollcli.files.inputs import stem_of
from rollcli.files.storage import write_output
from rollcli.files.stores.locations import within
from rollcli.run.find import find_frames
from rollcli.run.frame import Frame
from rollcli.run.outputs import check_places, listed_only
from rollcli.run.progress import Progress
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import run_tasks

if TYPE_CHECKING:
    from rollcli.evaluate.experiments import Findings, Times

PAGE = "paper.html"
FIGURES = ("table1_iterations", "table2_runtime", "fig3_lambda0", "fig6_accuracy", "methods_accuracy")
TABLES = ("maps", *FIGURES)


def run_paper(options: PaperOptions) -> ExitStatus:
    """Repeat the paper's experiments on maps.

    Parameters
    ----------
    options : PaperOptions

    Returns
    -------
    ExitStatus
        FRAMES_FAILED when a map gave no angle, INTERRUPTED when interrupted.

    Raises
    ------
    UsageError, InputError
        Exit status 2.
    OutputError
        Exit status 1.
    """
    require_extra("report", "the page of charts")
    if options.encoding.encoding == "depth":
        raise UsageError("--encoding depth: the experiments are made on disparity maps, not on depth maps")
    frames, folder = find_frames(options), options.experiments.output
    check_places(frames, options.folders)
    truth = _known_angles(frames, options)
    kind = options.experiments.figure
    names = [f"{name}.{kind}" for name in FIGURES] if kind is not None else []
    writes = [within(folder, name) for name in (*(f"{name}.csv" for name in TABLES), *names, PAGE)]
    reads = [path for frame in frames for path in frame.reads()]
    if listed_only(reads, writes, options.running):
        return ExitStatus.DONE
    return _run(frames, truth, options)


def _known_angles(frames: Sequence[Frame], options: PaperOptions) -> Mapping[str, KnownPose]:
    if options.experiments.truth is None:
        return {}
    truth = read_truth(options.experiments.truth)
    for frame in frames:
        if stem_of(frame.file) not in truth:
            raise UsageError(f"{frame.file}: has no known angle in {options.experiments.truth}")
    return truth


def _run(frames: Sequence[Frame], truth: Mapping[str, KnownPose], options: PaperOptions) -> ExitStatus:
    from rollcli.evaluate.experiments import examine_file, lost

    work = Work(partial(examine_file, options=options, truth=truth), lost)
    progress = Progress(len(frames), options.running, options.encoding, statuses=("ok",))
    found: list[Findings] = []
    failed: list[tuple[str, str]] = []
    with (
        stop_on_signals() as stop,
        progress,
        contextlib.closing(run_tasks(frames, work, stop, Workers(options.running.jobs))) as all_examined,
    ):
        for result, findings in all_examined:
            progress.add(result)
            if findings is None:
                failed.append((result.row.file, result.row.message))
            else:
                found.append(findings)
    if stop.asked:
        progress.say(f"interrupted after {progress.done} of {progress.total} maps; nothing is written")
        return ExitStatus.INTERRUPTED
    progress.tell_end()
    if not found:
        progress.say("no map gave an angle: there is nothing to tabulate")
        return progress.summary.status
    times = _time(frames, found, options, progress)
    _write(found, failed, times, options)
    progress.note(f"{within(options.experiments.output, PAGE)} and {len(TABLES)} tables are written")
    return progress.summary.status


def _time(
    frames: Sequence[Frame], found: "list[Findings]", options: PaperOptions, progress: Progress
) -> "list[Times]":
    """Take the run times on the first maps, in this process alone."""
    from rollcli.evaluate.experiments import time_solvers, usable_pixels
    from rollcli.run.read import read_source

    good = {findings.file for findings in found}
    chosen = [frame for frame in frames if frame.file in good][: options.experiments.timed]
    progress.note(f"run times, on {len(chosen)} of the maps")
    return [time_solvers(usable_pixels(read_source(frame, options.frame))) for frame in chosen]


def _write(
    found: "list[Findings]", failed: list[tuple[str, str]], times: "list[Times]", options: PaperOptions
) -> None:
    from rollcli.evaluate.paper_figures import paper_figures
    from rollcli.evaluate.paper_page import all_tables, paper_page, table_csv
    from rollcli.pictures.figures import PRINT
    from rollcli.report.figures import chart_file

    tables = all_tables(found, failed, times)
    figures = paper_figures(tables)
    page = paper_page(tables, figures, found, failed, times, options)
    written = {f"{name}.csv": table_csv(tables[name]) for name in TABLES} | {PAGE: page}
    if (kind := options.experiments.figure) is not None:
        for name, figure in figures.items():
            written[f"{name}.{kind}"] = chart_file(figure, kind, PRINT)
    for name, data in written.items():
        write_output(within(options.experiments.output, name), data, overwrite=options.running.overwrite)
