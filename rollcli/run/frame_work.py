"""What workers do with frames, whatever the command, and what is left of a frame that kills them.

Import-light: a worker alone loads what reads, estimates and draws.
"""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

from rollcli.files.atomic import remove_leftovers
from rollcli.files.containers import file_of
from rollcli.files.stores.locations import tasks_in_hand
from rollcli.run.frame import Frame, FrameResult, failed_frame
from rollcli.run.options import FrameOptions, FramesOptions
from rollcli.run.outputs import every_path, files_of, write_outputs
from rollcli.run.workers.chunks import Work, Workers


def do_frame(frame: Frame, options: FrameOptions) -> FrameResult:
    """Do the work on a frame, on a worker."""
    from rollcli.run.frame_task import run_frame

    return run_frame(frame, options)


def lost_frame(frame: Frame, reason: str, options: FrameOptions) -> FrameResult:
    """Make the row of a frame whose worker died, and remove its files of an earlier run."""
    paths = every_path(frame, options.writes)
    write_outputs({}, paths, replaces=options.replaces, retry_of=options.retry_of)
    return failed_frame(frame, reason)


def clear_frames(frames: Iterable[Frame], options: FrameOptions) -> None:
    """Remove the halves of files that a worker left which died amid one of these frames."""
    if not options.retry_of:  # they go when the row is written, with marks that are needed until then
        remove_leftovers(files_of(frames, options.writes))


def _decode(frame: Frame, options: FrameOptions) -> Frame:
    from rollcli.run.read import decoded  # loads NumPy, which other runs leave to the workers

    return decoded(frame, options)


def work_on(frames: Iterable[Frame], options: FrameOptions, **further: Any) -> Work[Frame, FrameResult]:
    """Say what is done with frames; `further` are fields of `Work`."""
    videos = any(frame.of_videos for frame in frames)
    return Work(
        partial(do_frame, options=options),
        partial(lost_frame, options=options),
        partial(clear_frames, options=options),
        prepare=partial(_decode, options=options) if videos else None,
        **further,
    )


def workers_for(frames: Sequence[Frame], options: FramesOptions, parts: Iterable[str] = ()) -> Workers:
    """Say which workers do the frames, what they write, and what they must see.

    `parts`: the folder of those parts of a result that they write.
    """
    files = tuple(file_of(path) for frame in (*frames[:1], *frames[-1:]) for path in frame.reads())
    folders, running = options.folders, options.running
    threads = tasks_in_hand((*files, *folders))
    return Workers(running.jobs, running.scheduler, files, (*folders, *parts), threads)
