"""Where the images of a frame lie."""

import contextlib
import posixpath
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rollcli.files.atomic import remove_leftovers
from rollcli.frames.options import ImageOptions

if TYPE_CHECKING:
    from rollcli.frames.frame import Frame

MAP_ENDINGS = {"png": ".png", "tiff": ".tif", "npy": ".npy"}


def image_paths(frame: "Frame", images: ImageOptions) -> Iterator[tuple[str, str]]:
    """(kind, path) of each image that this frame gets: its name and folders below the image folder."""
    computed = MAP_ENDINGS[images.save_as]
    endings = {
        "derotated": computed if frame.right_file else None,
        "vdisparity": ".png",
        "disparity": computed,
        "road_mask": ".png",
    }
    for kind, folder in images.folders():
        yield kind, output_path(frame, folder, endings[kind])


def output_path(frame: "Frame", folder: str, ending: str | None = None) -> str:
    """Where a file of this frame lies below `folder`; it keeps the frame's ending unless one is given."""
    stem, own = posixpath.splitext(frame.relative)
    return posixpath.join(folder, stem + (own if ending is None else ending))


def remove_images(frame: "Frame", images: ImageOptions, root: str = "") -> None:
    """Remove what was written for a frame: one that has no angle has no images either."""
    remove_outputs(str(Path(root, path)) for _, path in image_paths(frame, images))


def remove_outputs(paths: Iterable[str]) -> None:
    """Remove files that a frame which has failed has written, or an earlier run for it."""
    for path in paths:
        with contextlib.suppress(OSError):  # that there is no such file, or no such folder
            Path(path).unlink()


def remove_image_leftovers(frames: Iterable["Frame"], images: ImageOptions) -> None:
    """Remove the temporary files that killed workers left beside the images of these frames."""
    remove_leftovers(path for frame in frames for _, path in image_paths(frame, images))
