"""Where the images of a frame lie."""

import os
import posixpath
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rollcli.batch.options import ImageOptions
from rollcli.files.results import run_path

if TYPE_CHECKING:
    from rollcli.batch.job import Frame

_ENDINGS = {"png": ".png", "tiff": ".tif", "npy": ".npy"}


def image_paths(frame: "Frame", images: ImageOptions) -> Iterator[tuple[str, str]]:
    """(kind, path) of each image that this frame gets: its name and folders below the image folder."""
    stem, ending = posixpath.splitext(frame.relative)
    computed = _ENDINGS[images.save_as]
    endings = {
        "derotated": computed if frame.right_file else ending,
        "vdisparity": ".png",
        "disparity": computed,
        "road_mask": ".png",
    }
    for kind, folder in images.folders():
        yield kind, posixpath.join(folder, stem + endings[kind])


# how atomic files are called before they take their name: by the first hundred characters of it
_PREFIX = 100
_PART = re.compile(r"\.(.+)\.part", re.DOTALL)


def remove_leftovers(frames: Iterable["Frame"], images: ImageOptions, output: str | None) -> None:
    """Remove the temporary files that a killed run or worker left beside what it was writing; no others."""
    targets: dict[str, set[str]] = defaultdict(set)
    for path in (path for frame in frames for _, path in image_paths(frame, images)):
        folder, _, name = path.rpartition("/")
        targets[folder].add(name[:_PREFIX])
    if output is not None:
        record = run_path(output)
        targets[str(record.parent)].add(record.name[:_PREFIX])
    for folder, names in targets.items():
        for leftover in _leftovers(Path(folder), names):
            leftover.unlink(missing_ok=True)


def _leftovers(folder: Path, names: set[str]) -> list[Path]:
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        parts = [match for entry in entries if (match := _PART.fullmatch(entry.name))]
    return [folder / match[0] for match in parts if match[1] in names]
