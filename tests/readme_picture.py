"""Make the README's picture anew: python -m tests.readme_picture

A map of sample_data, and the same map de-rotated by the angle that is found in it, each beside its
v-disparity image.
"""

import cv2
import numpy as np

import rollcli
from rollcli.files.atomic import write_atomic
from rollcli.pictures.overlay import draw_disparity
from rollcli.pictures.vdisparity import MiddleColumn, draw_v_disparity
from tests.run_cli import ROOT

MAP, PICTURE = ROOT / "sample_data" / "maps" / "frame_0001.png", ROOT / ".github" / "readme.png"
_BINS, _GAP, _WIDE_GAP = 256, 6, 24


def picture() -> np.ndarray:
    """Both maps and both images in a row, BGRA; the gaps are transparent."""
    disparity = rollcli.read_disparity(MAP)
    roll = rollcli.estimate_roll(disparity)
    level = rollcli.derotate(disparity, roll.theta)
    before = rollcli.v_disparity(disparity, bins=_BINS)
    after = rollcli.v_disparity(level, bins=_BINS, max_disparity=before.max_disparity)
    column = MiddleColumn.of_level(roll.theta, roll.width, roll.height)
    parts = [
        draw_disparity(disparity),
        _gap(_GAP, roll.height),
        draw_v_disparity(before),
        _gap(_WIDE_GAP, roll.height),
        draw_disparity(level),
        _gap(_GAP, roll.height),
        draw_v_disparity(after, column.profile(roll.alpha)),
    ]
    height = max(len(part) for part in parts)
    return np.hstack([_padded(part if part.shape[2] == 4 else _opaque(part), height) for part in parts])


def _padded(part: np.ndarray, height: int) -> np.ndarray:
    return np.vstack([part, np.zeros((height - len(part), *part.shape[1:]), np.uint8)])


def _gap(width: int, height: int) -> np.ndarray:
    return np.zeros((height, width, 4), np.uint8)


def _opaque(part: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(part, cv2.COLOR_BGR2BGRA)


if __name__ == "__main__":
    write_atomic(PICTURE, cv2.imencode(".png", picture(), [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes())
