"""Make sample_data anew: python -m tests.make_sample_data

Five pairs of `rollcli simulate` and a map of each, four matched by SGBM and one exact, in the formats and
number types that such maps come in.
"""

import math
import shutil
from pathlib import Path

import cv2
import numpy as np

from rollcli.files.atomic import write_atomic
from rollcli.files.encodings import to_kitti
from rollcli.files.formats import encode_stored, read_image
from rollcli.simulate.dataset import Dataset, write_dataset
from rollcli.simulate.spec import FrameSpec
from rollcli.stereo.match import compute_disparity

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"
_RIG = {"size": (480, 360), "focal": 278.4, "colour": False}
SPECS = tuple(
    FrameSpec(scene, math.radians(roll_deg), math.radians(pitch_deg), curvature, seed=seed, **_RIG)
    for scene, roll_deg, pitch_deg, curvature, seed in (
        ("street", -8.0, 2.0, 0.0, 2),
        ("open", 3.0, 1.0, 0.0008, 11),
        ("verge", 12.0, 3.0, 0.0, 4),
        ("street", -4.0, 0.0, -0.0006, 9),
        ("bare", 20.0, 2.0, 0.0, 5),
    )
)
EXACT = "frame_0005"


def make(folder: Path) -> None:
    """Write left, right, maps and truth.csv into `folder`."""
    dataset = Dataset(folder, SPECS)
    for _ in write_dataset(dataset):
        pass
    maps, exact = folder / "maps", folder / "disparity" / f"{EXACT}.png"
    write_atomic(maps / exact.name, exact.read_bytes())
    shutil.rmtree(exact.parent)
    for stem in [task.stem for task in dataset.tasks]:
        if stem != EXACT:
            left, right = (read_image(folder / side / f"{stem}.png") for side in ("left", "right"))
            stored, ending = _stored(stem, compute_disparity(left, right, mode="3way", num_disparities=80))
            write_atomic(maps / f"{stem}.{ending}", encode_stored(stored, ending))


def _stored(stem: str, disparity: np.ndarray) -> tuple[np.ndarray, str]:
    if stem == "frame_0003":
        return disparity, "tiff"  # float32, pixels
    if stem == "frame_0004":
        sixteenths = np.where(disparity > 0, np.rint(disparity * 16), -16)  # as OpenCV's matcher gives it
        return sixteenths.astype(np.int16), "npy"
    return to_kitti(disparity), "png"


if __name__ == "__main__":
    cv2.setNumThreads(1)
    make(SAMPLES)
