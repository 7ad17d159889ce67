"""What doubtful files are taken for: real maps, what is made of them, and real photographs.

    python tests/benchmarks/bench_diagnosis.py

The maps of ../shared/realmaps and the lidar maps of ../shared/streets (KITTI), as they are, stretched to 8
bits, as depth maps in metres and millimetres, and upside down; the photographs of ../shared, of 8 and 16
bits, blurred, and dark. Every file is looked at, also where the program would not, since its angle is sure.
Prints a Markdown table of how many look like what.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rollcli.files.encodings import to_disparity
from rollcli.files.formats import Stored
from rollcli.run.diagnosis import looks_like
from rollcli.run.options import FramesOptions

SHARED = Path(__file__).resolve().parents[3] / "shared"
MAPS = (
    "realmaps/raw",
    "realmaps/refined",
    "realmaps/sgm",
    "realmaps/post",
    "realmaps/network",
    "streets/truth",
)
PHOTOGRAPHS = ("streets/left", "streets/right", "roads/left", "roads/right", "realmaps/sequence")
KINDS = ("nothing", "photograph", "depth", "depth or upside down", "upside down")
FOCAL_BASELINE = 721.5 * 0.54  # px m, of KITTI

Values = NDArray[Any]


def read(folders: Iterable[str], flags: int) -> list[Values]:
    """Read every image of the folders."""
    paths = [path for each in folders for path in sorted((SHARED / each).rglob("*")) if path.is_file()]
    images = [cv2.imread(str(path), flags) for path in paths]
    return [image for image in images if image is not None]


def verdict(values: Values) -> str:
    """What a file with these numbers looks like."""
    stored = Stored(np.ascontiguousarray(values), "png")
    said = looks_like(to_disparity(stored).disparity, stored, FramesOptions())
    found = [
        kind
        for kind, word in (("photograph", "photograph"), ("depth", "depth"), ("upside down", "upside"))
        if word in said
    ]
    return " or ".join(found) or KINDS[0]


def pixels(values: Values) -> Values:
    """Disparities of a map in px."""
    return np.asarray(to_disparity(Stored(values, "png")).disparity)


def depth(values: Values) -> Values:
    """Depths of a map in metres."""
    disparity = pixels(values)
    valid = disparity > 0
    return np.asarray(np.where(valid, FOCAL_BASELINE / np.where(valid, disparity, 1), 0), np.float32)


def stretched(values: Values) -> Values:
    """A map whose largest disparity is 255."""
    disparity = pixels(values)
    return np.rint(disparity * (255 / disparity.max())).astype(np.uint8)


OF_MAPS: dict[str, Callable[[Values], Values]] = {
    "maps": lambda values: values,
    "maps, stretched to 8 bits": stretched,
    "depth, metres": depth,
    "depth, millimetres": lambda values: np.clip(1000 * depth(values), 0, 65535).astype(np.uint16),
    "maps, upside down": lambda values: values[::-1],
}
OF_PHOTOGRAPHS: dict[str, Callable[[Values], Values]] = {
    "photographs": lambda values: values,
    "photographs, 16 bits": lambda values: values.astype(np.uint16) * 257,
    "photographs, blurred by 1.5 px": lambda values: cv2.GaussianBlur(values, (0, 0), 1.5),
    "photographs, a quarter as bright": lambda values: values // 4,
}


def main() -> None:
    """Print the table."""
    maps, photographs = read(MAPS, cv2.IMREAD_UNCHANGED), read(PHOTOGRAPHS, cv2.IMREAD_GRAYSCALE)
    if not (maps and photographs):
        print(f"{SHARED}: the real maps and photographs are not there")
        return
    print(f"| files | count | {' | '.join(KINDS)} |")
    print("|---|---|" + "---|" * len(KINDS))
    for files, changes in ((maps, OF_MAPS), (photographs, OF_PHOTOGRAPHS)):
        for name, change in changes.items():
            found = Counter(verdict(change(values)) for values in files)
            print(f"| {name} | {len(files)} | {' | '.join(str(found[kind]) for kind in KINDS)} |")


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
