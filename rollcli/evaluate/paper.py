"""`evaluate paper` from the command line: maps to workers, their findings to tables and one page."""

import contextlib
from collections.abc import Mapping, Sequence
from functools import partial

from rollcli import __version__
from rollcli.errors import ExitStatus, UsageError
from rollcli.evaluate.experiments import Examined, Findings, Times, examine_file, time_file
from rollcli.evaluate.options import PaperOptions
from rollcli.evaluate.paper_tables import DELTAS_DEG, METHOD_NAMES, SOLVER_NAMES, all_tables, table_csv
from rollcli.evaluate.truth import KnownPose, read_truth
from rollcli.extras import require_extra
from rollcli.files.inputs import stem_of
from rollcli.files.results import Row
from rollcli.files.storage import write_output
from rollcli.files.stores.locations import within
from rollcli.run.find import find_frames
from rollcli.run.frame import Frame, failed_frame
from rollcli.run.outputs import check_places, listed_only
from rollcli.run.progress import Progress
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.run.workers.tasks import run_tasks

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
    frames, folder = find_frames(options), options.output
    check_places(frames, options.folders)
    truth = dict[str, KnownPose]()
    if options.truth is not None:
        truth = read_truth(options.truth)
        if unknown := [frame.file for frame in frames if stem_of(frame.file) not in truth]:
            raise UsageError(f"{unknown[0]}: has no known angle in {options.truth}")
    kind = options.figure
    names = [f"{name}.{kind}" for name in FIGURES] if kind is not None else []
    writes = [within(folder, name) for name in (*(f"{name}.csv" for name in TABLES), *names, PAGE)]
    reads = [*filter(None, [options.truth]), *(path for each in frames for path in each.reads())]
    if listed_only(lambda: [(reads, writes)], options.running):
        return ExitStatus.DONE
    return _run(frames, truth, options)


def _run(frames: Sequence[Frame], truth: Mapping[str, KnownPose], options: PaperOptions) -> ExitStatus:
    examined_by = partial(examine_file, options=options, truth=truth)
    work = Work(examined_by, lambda frame, reason: (failed_frame(frame, reason), None))
    progress = Progress(len(frames), options, statuses=("ok",))
    examined: list[Examined] = []
    with (
        stop_on_signals() as stop,
        progress,
        contextlib.closing(run_tasks(frames, work, stop, Workers(options.running.jobs))) as all_examined,
    ):
        for each in all_examined:
            progress.add(each[0])
            examined.append(each)
    if stop.asked:
        progress.say(f"interrupted after {progress.done} of {progress.total} maps; nothing is written")
        return ExitStatus.INTERRUPTED
    progress.tell_end()
    found = [findings for _, findings in examined if findings is not None]
    failed = [result.row for result, findings in examined if findings is None]
    if not found:
        progress.say("no map gave an angle: there is nothing to tabulate")
        return progress.summary.status
    good = [frame for frame, (_, findings) in zip(frames, examined, strict=True) if findings is not None]
    chosen = good[: options.timed]
    progress.note(f"run times, on {len(chosen)} of the maps")
    # in this process alone
    times = [time_file(frame, options) for frame in chosen]
    for name, data in paper_files(found, failed, times, options).items():
        write_output(within(options.output, name), data, overwrite=options.running.overwrite)
    progress.note(f"{within(options.output, PAGE)} and {len(TABLES)} tables are written")
    return progress.summary.status


def paper_files(
    found: Sequence[Findings], failed: Sequence[Row], times: Sequence[Times], options: PaperOptions
) -> dict[str, bytes]:
    """Make the tables, the page and what else was asked for, by the names of their files.

    Parameters
    ----------
    found : sequence of Findings
        Of each map.
    failed : sequence of Row
        Of maps without findings; they say why.
    times : sequence of Times
        Of some maps.
    options : PaperOptions
    """
    from rollcli.evaluate.paper_figures import paper_figures
    from rollcli.pictures.figures import PRINT
    from rollcli.report.figures import chart_file, stills
    from rollcli.report.page import render_page

    tables = all_tables(found, failed, times)
    figures = paper_figures(tables)
    page = render_page(
        "rollcli.evaluate",
        PAGE,
        title=f"The paper's experiments on {len(found)} map{'' if len(found) == 1 else 's'}",
        version=__version__,
        deltas=DELTAS_DEG,
        solvers=SOLVER_NAMES,
        methods=METHOD_NAMES,
        tables=tables,
        charts=figures,
        stills=stills,
        found=found,
        failed=failed,
        times=times,
        options=options,
        region=options.has_region,
    )
    kind = options.figure
    printed = {} if kind is None else figures
    return {
        **{f"{name}.csv": table_csv(table) for name, table in tables.items()},
        PAGE: page,
        **{f"{name}.{kind}": chart_file(figure, str(kind), PRINT) for name, figure in printed.items()},
    }
