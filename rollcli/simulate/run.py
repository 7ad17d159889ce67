"""Run `rollcli simulate`: plan, write, and say how far it is."""

import sys

from rollcli.errors import ExitStatus
from rollcli.files.encodings import KITTI_TOP
from rollcli.frames.options import RunningOptions
from rollcli.messages import say
from rollcli.parallel.interrupt import stop_on_signals
from rollcli.parallel.progress import TaskProgress
from rollcli.simulate.dataset import Dataset, write_dataset
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.plan import plan_dataset


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
