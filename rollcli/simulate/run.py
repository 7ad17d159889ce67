"""A simulation from the command line: what it says and what it writes."""

import sys
import time

from rollcli.batch.options import RunningOptions
from rollcli.simulate.dataset import plan_dataset, usable_processors, write_dataset
from rollcli.simulate.options import SimulateOptions


def run(folder: str, options: SimulateOptions, running: RunningOptions) -> None:
    """Do what was asked; `UsageError` and `OutputError` say what went wrong."""
    dataset = plan_dataset(folder, options, overwrite=running.overwrite)
    if running.dry_run:
        sys.stdout.writelines(f"write {path}\n" for path in dataset.files())
        return
    from tqdm import tqdm

    start, hidden = time.monotonic(), running.quiet or not sys.stderr.isatty()
    done = write_dataset(dataset, running.jobs or usable_processors())
    for stem in tqdm(done, total=len(dataset.specs) + 1, unit=" frames", disable=hidden):
        if running.verbose and not running.quiet:
            tqdm.write(f"rollcli: {stem} written", file=sys.stderr)
    if not running.quiet:
        seconds = time.monotonic() - start
        sys.stderr.write(f"rollcli: {len(dataset.specs)} frames in {dataset.folder}; {seconds:.1f} s\n")
