"""A simulation from the command line: what it writes, and what it says meanwhile."""

import sys
import time

from rollcli.errors import ExitStatus
from rollcli.frames.options import RunningOptions
from rollcli.messages import say
from rollcli.parallel.interrupt import stop_on_signals
from rollcli.simulate.dataset import KITTI_TOP, Dataset, plan_dataset, write_dataset
from rollcli.simulate.options import SimulateOptions


def run_simulate(folder: str, options: SimulateOptions, running: RunningOptions) -> ExitStatus:
    """Write the simulated frames.

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
    start, total = time.monotonic(), len(dataset.specs)
    done = _write(dataset, running)
    if done < total:
        say(f"interrupted after {done} of {total} frames; start again with --overwrite")
        return ExitStatus.INTERRUPTED
    if not running.quiet:
        say(f"{total} frames in {dataset.folder}; {time.monotonic() - start:.1f} s")
    return ExitStatus.DONE


def _write(dataset: Dataset, running: RunningOptions) -> int:
    """Write the frames, and truth.csv if that is all of them; how many there are."""
    from tqdm import tqdm

    done, hidden = 0, running.quiet or not sys.stderr.isatty()
    with stop_on_signals() as stop, tqdm(total=len(dataset.specs), unit=" frames", disable=hidden) as bar:
        for stem in write_dataset(dataset, running.jobs, stop):
            done += 1
            bar.update()
            if running.verbose and not running.quiet:
                bar.clear()
                say(f"{stem} written")
                bar.refresh()
    return done
