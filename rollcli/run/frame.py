"""The records of a frame: what a worker is told and what it returns. Import-light: never loads NumPy."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rollcli.files.atomic import is_there
from rollcli.files.containers import file_of, is_video
from rollcli.files.results import Row
from rollcli.files.storage import Note
from rollcli.files.stores.locations import is_remote, is_url
from rollcli.messages import one_line, without_secrets
from rollcli.rig.calibration import Calibration

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Frame(NamedTuple):
    """A map or a stereo pair, as a worker is told of it.

    Attributes
    ----------
    file, right_file : str
        As the user named them, for the row; `right_file` is empty for a map.
    path, right_path : str
        Where they are.
    relative : str
        Path below the folder it was found in; names its images. Empty where its URL names no file: the frame
        is an error.
    mask : str or None
        The mask file of this frame.
    calibration : Calibration or None
        Of the images as they are in the files; None: without pitch and height.
    row : Row or None
        Its own in the result that a conversion is given.
    decoded : Decoded or None
        Its views, where they were read before it was handed out.
    damaged : str
        What is wrong with the file of its calibration, which cannot be read; empty otherwise.
    """

    file: str
    right_file: str
    path: str
    right_path: str
    relative: str
    mask: str | None
    calibration: Calibration | None = None
    row: Row | None = None
    decoded: "Decoded | None" = None
    damaged: str = ""

    def reads(self) -> Iterator[str]:
        """Yield every file that this frame needs."""
        yield self.path
        if self.right_path not in ("", self.path):  # one image may hold both views
            yield self.right_path
        if self.mask is not None:
            yield self.mask

    @property
    def of_videos(self) -> bool:
        """Whether its views are frames of videos, which are decoded in order."""
        return all(is_video(file_of(path)) for path in (self.path, self.right_path))


def frame_of_row(row: Row, result: str) -> Frame:
    """Return the frame of a row; names are of where `estimate` ran: of this folder, or of the result's."""
    path, right = (located_beside(name, result) for name in (row.file, row.right_file))
    return Frame(row.file, row.right_file, path, right, relative=row.file, mask=None)


def located_beside(name: str, result: str) -> str:
    """Locate a file that a result names: as it is named, or else from the folder of the result."""
    if not name or is_remote(name):  # even a look at a share of Windows is a request
        return name
    folder = Path() if is_url(result) else Path(result).parent  # names in a bucket are whole URLs
    beside = str(folder / name)
    return beside if not is_there(file_of(name)) and is_there(file_of(beside)) else name


class Decoded(NamedTuple):
    """The left and the right view of a frame, and a note of what each location held that was read."""

    views: "tuple[NDArray[Any], NDArray[Any]]"
    notes: Mapping[str, Note]


class ReadAs(NamedTuple):
    """How frames were read, as far as they were.

    Attributes
    ----------
    encodings : frozenset of str
        How the numbers of maps were read.
    searched : tuple of int, or None
        First and last disparity searched, px; pairs only.
    downscale : float
        By how much wider than a map the images are that it was matched from.
    """

    encodings: frozenset[str] = frozenset()
    searched: tuple[int, int] | None = None
    downscale: float = 1.0

    def joined(self, other: "ReadAs") -> "ReadAs":
        """Return how these and other frames were read."""
        ends = [*(self.searched or ()), *(other.searched or ())]
        names, larger = self.encodings | other.encodings, max(self.downscale, other.downscale)
        return ReadAs(names, (min(ends), max(ends)) if ends else None, larger)


@dataclass(frozen=True)
class FrameResult:
    """The row of a frame, and what the user is told once about its input.

    Attributes
    ----------
    row : Row
    read_as : ReadAs
    warnings : mapping of str to str
        Why that may be wrong, and what else the user should know; by code, those that are empty left out.
    inputs : bytes
        What the frame was read from, where workers were told to note it: see `result_file.inputs_line`.
    cause : str
        The code of its error: the same for all frames that failed for one cause.
    said : str
        The error as stderr says it: with the name of the file that it is about.
    """

    row: Row
    read_as: ReadAs = field(default_factory=ReadAs)
    warnings: Mapping[str, str] = field(default_factory=dict)
    inputs: bytes = b""
    cause: str = ""
    said: str = ""

    @property
    def warning(self) -> str:
        """All warnings; empty when there is none."""
        return "; ".join(filter(None, self.warnings.values()))


def failed_frame(frame: Frame, reason: str, cause: str = "") -> FrameResult:
    """Make the `error` row of a frame; its message is one line that does not repeat the names of the row.

    `cause` is its code; by default, the reason names no frame and is the code itself.
    """
    message, about, view = one_line(without_secrets(reason)), frame.file, ""
    # one image may hold both views
    names = {frame.file: ""}
    if frame.right_file not in ("", frame.file):
        names = {frame.right_file: "right image: ", frame.file: "left image: "}
    for name, called in names.items():
        if message.startswith(f"{one_line(name)}: "):
            about, view, message = name, called, message.removeprefix(f"{one_line(name)}: ")
            break
    row = Row(frame.file, frame.right_file, "error", message=view + message)
    return FrameResult(row, cause=cause or reason, said=f"{about}: {message}")
