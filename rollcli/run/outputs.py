"""Where the files that are written for a frame lie."""

import contextlib
import hashlib
import itertools
import posixpath
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import lru_cache

from rollcli.errors import InputError, OutputError
from rollcli.files.atomic import mark_path, remove_leftovers
from rollcli.files.results import STATUSES
from rollcli.files.storage import read_bytes, remove, remove_all, write_bytes, write_new
from rollcli.files.stores.locations import is_url, located
from rollcli.run.frame import Frame
from rollcli.run.options import ENDING_OF_FORMAT, ImageKind, ImageOptions


def image_paths(frame: Frame, images: ImageOptions) -> Iterator[tuple[ImageKind, str]]:
    """Yield (kind, path) of each image that is written for a frame."""
    if not frame.relative:
        return
    for kind, folder, ending in _kinds(images, computed=bool(frame.right_file)):
        yield kind, output_path(frame, folder, ending)


@lru_cache(maxsize=16)  # the same for each of a million frames
def _kinds(images: ImageOptions, *, computed: bool) -> tuple[tuple[ImageKind, str, str | None], ...]:
    """List (kind, folder, ending) of the images; None is the ending of the frame's own file."""
    return tuple(
        (kind, folder, kind.ending(images.save_as, computed=computed)) for kind, folder in images.folders()
    )


def roomy_path(path: str) -> str:
    """Name the TIFF that is written in place of a KITTI PNG which cannot hold the map."""
    return posixpath.splitext(path)[0] + ENDING_OF_FORMAT["tiff"]


def possible_paths(frame: Frame, images: ImageOptions) -> Iterator[tuple[str, ...]]:
    """Yield, for each image of a frame, the paths of which one is written."""
    for kind, path in image_paths(frame, images):
        overflows = kind.can_overflow(images.save_as, computed=bool(frame.right_file))
        yield (path, roomy_path(path)) if overflows else (path,)


def local_images(
    frames: Iterable[Frame], status: bytes, images: ImageOptions, root: str = ""
) -> Iterator[str]:
    """Yield the images of those frames that have angles which a power cut may take from a local disk."""
    if not images.folders():
        return
    for frame, place in zip(frames, status, strict=True):
        if STATUSES[place] != "error":
            yield from itertools.filterfalse(is_url, every_path(frame, images, root))


def output_path(frame: Frame, folder: str, ending: str | None = None) -> str:
    """Name the file of a frame below `folder`; it keeps the frame's own ending unless one is given."""
    name = frame.relative if ending is None else posixpath.splitext(frame.relative)[0] + ending
    return f"{folder}{name}" if folder.endswith("/") else f"{folder}/{name}"


def every_path(frame: Frame, images: ImageOptions, root: str = "") -> list[str]:
    """List every image that may be written for a frame, from a folder where relative paths start."""
    return [located(root, path) for paths in possible_paths(frame, images) for path in paths]


def write_outputs(
    files: Mapping[str, bytes], paths: Collection[str], *, replaces: bool, retry_of: str = ""
) -> None:
    """Write the files of a frame, each whole or not at all; a failed frame has none.

    Parameters
    ----------
    files : mapping from str to bytes
        What is written, by its path.
    paths : collection of str
        All that may be written for the frame.
    replaces : bool
        Whether files of an earlier run are replaced, and those that are not written now removed: they would
        pass for this run's. Otherwise nothing that another run or program wrote is touched.
    retry_of : str
        The result whose failed frame is done again. What an earlier retry of it made and did not live to
        write a row of is taken back: a mark beside such a file says so until the row is in the result.

    Raises
    ------
    OutputError
        One cannot be written, or must not be replaced.
    """
    if retry_of and not replaces:
        _write_marked(files, paths, retry_of)
        return
    write = write_bytes if replaces else write_new
    for path, data in files.items():
        write(path, data)
    if replaces:
        for path in paths:
            if path not in files:
                with contextlib.suppress(OutputError):  # the row says what is wrong with the frame
                    remove(path)


def _write_marked(files: Mapping[str, bytes], paths: Collection[str], result: str) -> None:
    for path in paths:
        _take_back(path, result)
    for path, data in files.items():
        write_bytes(mark_path(path), _mark(data, result))
        try:
            write_new(path, data)
        except OutputError:
            remove(mark_path(path))
            raise


def _take_back(path: str, result: str) -> None:
    """Remove a file that a retry of this result made, unless somebody has changed it since."""
    with contextlib.suppress(InputError):  # it was not marked, or is gone
        if read_bytes(mark_path(path)) == _mark(read_bytes(path), result):
            remove(path)


def _mark(data: bytes, result: str) -> bytes:
    return hashlib.sha256(result.encode("utf-8", "surrogateescape") + b"\0" + data).hexdigest().encode()


def remove_marks(frames: Collection[Frame], images: ImageOptions) -> None:
    """Remove the marks beside the images of frames that were done again, and what killed workers left."""
    paths = [path for frame in frames for path in every_path(frame, images)]
    marks = [mark_path(path) for path in paths]
    remove_leftovers([*paths, *marks])
    remove_all(filter(is_url, marks))


def remove_image_leftovers(frames: Iterable[Frame], images: ImageOptions) -> None:
    """Remove the temporary files that killed workers left beside the images of these frames."""
    remove_leftovers(path for frame in frames for path in every_path(frame, images))
