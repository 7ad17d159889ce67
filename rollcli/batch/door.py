"""What workers are told to do with a frame. Import-light: the dispatcher never loads NumPy, workers do."""

from rollcli.frames.frame import Frame, FrameResult, failed_frame
from rollcli.frames.options import FrameOptions, ImageOptions
from rollcli.frames.outputs import remove_image_leftovers, remove_images


def estimate_frame(frame: Frame, options: FrameOptions) -> FrameResult:
    """Estimate the roll of a frame, on a worker."""
    from rollcli.batch.frame_task import run_frame

    return run_frame(frame, options)


def lost_frame(frame: Frame, reason: str, images: ImageOptions) -> FrameResult:
    """Make the row of a frame whose worker died, and remove its images, which an error row never has."""
    remove_images(frame, images)
    remove_image_leftovers([frame], images)
    return failed_frame(frame, reason)
