"""Run `rollcli simulate`: plan, write, and say how far it is."""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rollcli import __version__
from rollcli.errors import ExitStatus, InputError, UsageError
from rollcli.files.atomic import output_error
from rollcli.files.encodings import KITTI_TOP
from rollcli.files.locking import differences, not_resumable
from rollcli.files.results import read_run, run_path
from rollcli.messages import say
from rollcli.run.options import RunningOptions
from rollcli.run.progress import TaskProgress
from rollcli.run.workers.interrupt import stop_on_signals
from rollcli.simulate.dataset import TRUTH, Dataset, write_dataset
from rollcli.simulate.draw import draw_specs
from rollcli.simulate.options import CROSSFALL, KERB, KERBED, MIXED, SimulateOptions


def plan_dataset(folder: str | Path, options: SimulateOptions, *, overwrite: bool = False) -> Dataset:
    """Draw the frames, and check that they can be written.

    Parameters
    ----------
    folder : str or Path
        Where to write; made if it does not exist.
    options : SimulateOptions
        What to render.
    overwrite : bool
        Whether to begin anew in a folder with files in it.

    Raises
    ------
    UsageError
        Options contradict each other, or the folder has files in it that may not be replaced or continued.
    """
    if options.resume and overwrite:
        raise UsageError("give either --resume or --overwrite")
    _refuse_idle(options)
    specs = draw_specs(
        options.frames,
        scene=options.scene,
        roll=_radians(options.roll_deg),
        pitch=_radians(options.pitch_deg),
        curvature=options.curvature,
        bend=options.bend,
        cross_section=options.cross_section,
        crossfall=_shares(options.crossfall or CROSSFALL),
        gutter=_shares(options.gutter),
        kerb=options.kerb or KERB,
        roughness=options.roughness,
        dips=options.dips,
        size=options.size,
        focal=options.focal,
        baseline=options.baseline,
        height=options.height,
        principal_point=options.principal_point,
        principal_offset=options.principal_offset,
        noise=options.noise,
        gain=options.gain,
        colour=not options.grey,
        seed=options.seed,
    )
    dataset = Dataset(Path(folder), tuple(specs), _record(options))
    if _is_free(Path(folder)) or overwrite:
        return dataset
    if not options.resume:
        raise UsageError(
            f"{folder}: there are files in it; --resume continues an interrupted simulation, "
            "--overwrite begins anew"
        )
    _check_resumable(dataset)
    whole = (task.stem for task in dataset.tasks if all(path.exists() for path in task.images()))
    return replace(dataset, kept=frozenset(whole))


def _refuse_idle(options: SimulateOptions) -> None:
    """Refuse options that change nothing in the frames that are asked for."""
    if options.crossfall is not None and options.cross_section == "flat":
        raise UsageError("--crossfall: a flat road has none; choose another --cross-section")
    if options.kerb is not None and options.scene not in (*KERBED, MIXED):
        raise UsageError(f"--kerb: the scene {options.scene} has no kerbs; {' and '.join(KERBED)} have")


def _is_free(folder: Path) -> bool:
    """Tell whether the folder is empty or does not exist."""
    try:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"{folder}: is a file, not a folder to write to")
        return not folder.is_dir() or not any(folder.iterdir())
    except OSError as error:
        raise output_error(folder, error) from error


def _record(options: SimulateOptions) -> Mapping[str, Any]:
    """Collect what decides the bytes of the frames: the version, and the options by their names."""
    values = {key.removesuffix("_deg").replace("_", "-"): value for key, value in asdict(options).items()}
    del values["resume"]
    return {"rollcli": __version__, "options": values}


def _check_resumable(dataset: Dataset) -> None:
    """Refuse to continue a folder of another version, of other options or without a record.

    Raises
    ------
    UsageError
        Says what differs.
    """
    name, record = str(dataset.folder), run_path(TRUTH)
    try:
        was = read_run(dataset.folder / TRUTH)
    except InputError as error:
        raise not_resumable(name, f"{record} is damaged") from error
    if was is None:
        raise not_resumable(name, f"there is no {record}")
    if not isinstance(was.get("rollcli"), str) or not isinstance(was.get("options"), dict):
        raise not_resumable(name, f"{record} is damaged")
    for difference in differences(was, dataset.record or {}):
        raise not_resumable(name, difference)


def _shares(percent: Sequence[float]) -> tuple[float, float]:
    return percent[0] / 100, percent[1] / 100


def _radians(span: Sequence[float]) -> tuple[float, float]:
    return math.radians(span[0]), math.radians(span[1])


def run_simulate(
    folder: str, options: SimulateOptions, running: RunningOptions, resume_command: str = ""
) -> ExitStatus:
    """Write the simulated frames.

    Parameters
    ----------
    folder : str
        Where to write.
    options : SimulateOptions
        What to render.
    running : RunningOptions
        How to run, and how much to say.
    resume_command : str
        The command that continues this simulation when it is interrupted.

    Raises
    ------
    UsageError, OutputError
        Exit statuses 2 and 1.
    """
    dataset = plan_dataset(folder, options, overwrite=running.overwrite)
    if running.dry_run:
        sys.stdout.writelines(f"write {path}\n" for path in dataset.files())
        return ExitStatus.DONE
    if dataset.nearest_disparity > KITTI_TOP and not running.quiet:
        say(
            f"the road reaches {dataset.nearest_disparity:.0f} px of disparity: what exceeds "
            f"{KITTI_TOP:.0f} px does not fit a KITTI PNG and has no data in {dataset.folder}/disparity"
        )
    progress = TaskProgress(len(dataset.specs), quiet=running.quiet, verbose=running.verbose)
    progress.kept = len(dataset.kept or ())
    with stop_on_signals() as stop, progress:
        for stem in write_dataset(dataset, running.jobs, stop):
            progress.advance()
            progress.detail(f"{stem} written")
    if progress.done < progress.total:
        say(f"interrupted after {progress.done} of {progress.total} frames; continue with: {resume_command}")
        return ExitStatus.INTERRUPTED
    progress.note(_summary(dataset, progress))
    return ExitStatus.DONE


def _summary(dataset: Dataset, progress: TaskProgress) -> str:
    """Make the last line: how many frames, and what one cost."""
    kept = f" ({progress.kept} kept)" if progress.kept else ""
    rendered = progress.done - progress.kept
    cost = f", {progress.seconds / rendered:.2f} s a frame" if rendered else ""
    return f"{progress.done} frames{kept} in {dataset.folder}; {progress.seconds:.1f} s{cost}"
