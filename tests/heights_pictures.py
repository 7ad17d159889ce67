"""Make the pictures of heights over the road anew: python -m tests.heights_pictures

A pothole and a street are rendered, matched and estimated as `estimate` does it. README: the left image, and
the heights over it. rollcli/pictures/README.md: the authors' transformed disparity beside the heights.
"""

from pathlib import Path

import cv2
import numpy as np

import rollcli
from rollcli.files.atomic import write_atomic
from rollcli.pictures.heights import METRES, steadied
from rollcli.pictures.overlay import as_bgr, draw_heights, draw_preview
from rollcli.rig.calibration import Calibration
from rollcli.simulate.build import RenderedFrame, render_frame
from rollcli.simulate.spec import FrameSpec
from tests.run_cli import ROOT

PICTURES = ROOT / ".github"
_RIG = {"size": (640, 300), "focal": 520.0, "height": 1.65}
SCENES = (
    FrameSpec("bare", roll=0.06, pitch=0.16, dips=4, seed=18, **_RIG),
    FrameSpec("street", roll=-0.04, pitch=0.05, kerb=(0.1, 0.1), dips=3, seed=13, **_RIG),
)
_GAP, _QUALITY = 8, 85


def main(folder: Path = PICTURES) -> None:
    """Write both pictures."""
    frames = [render_frame(spec) for spec in SCENES]
    parts = [_drawn(frame, spec) for frame, spec in zip(frames, SCENES, strict=True)]
    photos = [as_bgr(frame.left, spec.size) for frame, spec in zip(frames, SCENES, strict=True)]
    rows = [_beside(photo, heights) for photo, (_, heights) in zip(photos, parts, strict=True)]
    _write(folder / "heights.webp", rows)
    _write(folder / "transformed.webp", [_beside(*each) for each in parts])


def _drawn(frame: RenderedFrame, spec: FrameSpec) -> tuple[np.ndarray, np.ndarray]:
    """The transformed disparity of the authors, and the heights over the left image."""
    disparity = rollcli.compute_disparity(frame.left, frame.right)
    estimate = rollcli.estimate_roll(disparity)
    rig = Calibration(spec.focal, spec.focal, *spec.centre, spec.baseline)
    heights = steadied(rollcli.height_map(disparity, estimate, rig))
    v, u = np.indices(disparity.shape)
    along = v * np.cos(estimate.theta) - u * np.sin(estimate.theta)
    transformed = disparity - np.polynomial.Polynomial(estimate.alpha)(along) + 5
    shown = np.where((disparity > 0) & (np.abs(transformed - 5) < 5), transformed, 0)
    return draw_preview(shown), draw_heights(heights, (-0.1, 0.1), METRES, frame.left)


def _beside(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.hstack([left, np.full((len(left), _GAP, 3), 255, np.uint8), right])


def _write(path: Path, rows: list[np.ndarray]) -> None:
    gap = np.full((_GAP, rows[0].shape[1], 3), 255, np.uint8)
    picture = np.vstack([rows[0], gap, *rows[1:]])
    _, data = cv2.imencode(".webp", picture, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    write_atomic(path, data.tobytes())


if __name__ == "__main__":
    main()
