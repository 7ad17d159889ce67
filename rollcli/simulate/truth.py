"""The known values of rendered frames: truth.csv, and the calibration of the rig in KITTI's form."""

import csv
import io
import math
from collections.abc import Iterable

import numpy as np

from rollcli.simulate.scenes.build import carriageway_of, road_camber
from rollcli.simulate.spec import FrameSpec

COLUMNS = (
    "file",
    "roll_deg",
    "pitch_deg",
    "scene",
    "focal_px",
    "cx_px",
    "cy_px",
    "baseline_m",
    "height_m",
    "curvature_per_m",
    "seed",
    "cross_section",
    "crossfall_percent",
    "gutter_percent",
    "camber",
    "bend_per_m",
)


def truth_csv(frames: Iterable[tuple[str, FrameSpec]]) -> bytes:
    """Write the table of known values, one row for each stem and its frame."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for stem, spec in frames:
        angles = (f"{math.degrees(angle) + 0.0:.9f}" for angle in (spec.roll, spec.pitch))
        rig = map(_number, (spec.focal, *spec.centre, spec.baseline, spec.height, spec.curvature))
        slopes = (_number(100 * slope) for slope in (spec.crossfall, spec.gutter))
        # a roof has a ridge instead of a curvature
        camber = "" if spec.cross_section == "roof" else _number(road_camber(spec))
        road = (spec.cross_section, *slopes, camber, _number(carriageway_of(spec).course.bend))
        rows.writerow((stem, *angles, spec.scene, *rig, spec.seed, *road))
    return text.getvalue().encode()


def calibration(spec: FrameSpec) -> bytes:
    """Write the rectified projections of the left and the right view, P0 and P1 of KITTI's benchmarks.

    Both are 3x4, row by row, in pixels and metres; the fourth number of P1 is -focal * baseline. See Geiger,
    Lenz, Urtasun, "Are we ready for autonomous driving?", CVPR 2012.
    """
    left = np.zeros((3, 4))
    left[0, 0] = left[1, 1] = spec.focal
    left[:2, 2] = spec.centre
    left[2, 2] = 1.0
    right = left.copy()
    right[0, 3] = -spec.focal * spec.baseline
    lines = (f"P{i}: {' '.join(f'{x:.12e}' for x in view.ravel())}\n" for i, view in enumerate((left, right)))
    return "".join(lines).encode()


def _number(value: float) -> str:
    return f"{value + 0.0:.10g}"  # + 0.0 turns -0.0 into 0
