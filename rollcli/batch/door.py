"""What workers are told to do with a frame. Import-light: the dispatcher never loads NumPy, workers do."""

from rollcli.frames.frame import Frame, FrameResult, failed_frame
from rollcli.frames.options import FrameOptions
from rollcli.frames.outputs import every_path, remove_image_leftovers, write_outputs


def estimate_frame(frame: Frame, options: FrameOptions) -> FrameResult:
    """Estimate the roll of a frame, on a worker."""
    from rollcli.batch.frame_task import run_frame

    return run_frame(frame, options)


def lost_frame(frame: Frame, reason: str, options: FrameOptions) -> FrameResult:
    """Make the row of a frame whose worker died, and remove its images of an earlier run."""
    paths = every_path(frame, options.images)
    write_outputs({}, paths, replaces=options.replaces, retry_of=options.retry_of)
    return failed_frame(frame, reason)


def clear_frame(frame: Frame, options: FrameOptions) -> None:
    """Remove the halves of images that a worker left which died amid this frame."""
    if not options.retry_of:  # they go when the row is written, with marks that are needed until then
        remove_image_leftovers([frame], options.images)
