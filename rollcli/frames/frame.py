"""What goes to a worker and what comes back: light, so that who only hands out work stays small."""

from collections.abc import Iterator
from dataclasses import dataclass

from rollcli.files.results import Row
from rollcli.frames.options import FrameOptions, ImageOptions
from rollcli.frames.outputs import remove_image_leftovers, remove_images
from rollcli.rig.calibration import Calibration


@dataclass(frozen=True, slots=True)
class Frame:
    """A map or a pair: what a worker is told about it. `file` and `right_file` are as the user named them.

    Attributes
    ----------
    file, right_file : str
        What the row says; `right_file` is empty for a map.
    path, right_path : str
        Where they are.
    relative : str
        Below the folder it was found in; names its images.
    mask : str or None
        The mask file for this frame.
    calibration : Calibration or None
        Of the images as they are in the files; None: without pitch and height.
    """

    file: str
    right_file: str
    path: str
    right_path: str
    relative: str
    mask: str | None
    calibration: Calibration | None = None

    def reads(self) -> Iterator[str]:
        """Every file that this frame needs."""
        yield self.path
        if self.right_path:
            yield self.right_path
        if self.mask is not None:
            yield self.mask


@dataclass(frozen=True)
class Outcome:
    """The row of a frame, and what the run wants to say once about its input.

    Attributes
    ----------
    row : Row
    encoding : str
        How the map's numbers were read; empty for pairs and failed frames.
    warning : str
        Why that may be wrong; empty when there is no doubt.
    searched : tuple of int, or None
        First and last disparity searched, px; pairs only.
    """

    row: Row
    encoding: str = ""
    warning: str = ""
    searched: tuple[int, int] | None = None


def do(frame: Frame, options: FrameOptions) -> Outcome:
    """Do one frame where the work is done: in a worker, NumPy and OpenCV are there."""
    from rollcli.batch.frame_task import run_frame

    return run_frame(frame, options)


def failed(frame: Frame, reason: str) -> Outcome:
    """The row of a frame without an angle; one line that names the file."""
    line, *names = (" ".join(text.split()) for text in (reason, frame.file, frame.right_file or frame.file))
    named = line if line.startswith(tuple(names)) else f"{names[0]}: {line}"
    return Outcome(Row(frame.file, frame.right_file, "error", message=named))


def lost(frame: Frame, reason: str, images: ImageOptions) -> Outcome:
    """The row of a frame whose worker died; what it wrote is removed, since an error row has no images."""
    remove_images(frame, images)
    remove_image_leftovers([frame], images)
    return failed(frame, reason)
