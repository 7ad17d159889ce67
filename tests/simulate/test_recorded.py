"""Frames are those that this version is known to render; see `tests.recorded`."""

import csv
import io

import numpy as np
import pytest

from rollcli.simulate.build import render_frame
from rollcli.simulate.dataset import calibration, truth_csv
from rollcli.simulate.options import CROSS_SECTIONS, ROUGHNESS, SCENES, SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from tests.recorded import unlike_record

SMALL = {"size": (96, 64), "grey": True}
DRAWN = {
    **{scene: {"scene": scene, "frames": 3, "seed": 7} for scene in SCENES},
    **{shape: {"cross_section": shape, "gutter": (0, 8), "seed": 8} for shape in CROSS_SECTIONS},
    **{f"roughness {grade}": {"roughness": grade, "scene": "street", "seed": 9} for grade in ROUGHNESS},
    "dips": {"dips": 9, "scene": "open", "frames": 3, "seed": 10},
    "mixed": {
        "cross_section": "mixed",
        "frames": 3,
        "height": (1, 3),
        "principal_offset": (-5, 5),
        "seed": 11,
    },
    "bent": {
        "bend": (-0.02, 0.02),
        "curvature": (-0.01, 0.01),
        "frames": 3,
        "roll_deg": (-80, 80),
        "seed": 12,
    },
    "kerb": {"kerb": (0.3, 0.5), "scene": "street", "gain": 0.7, "noise": 4.0, "focal": 60.0, "seed": 13},
    "colour": {
        "grey": False,
        "scene": "street",
        "principal_point": (50.0, 60.0),
        "baseline": 0.2,
        "seed": 14,
    },
    "from above": {"pitch_deg": (20, 60), "scene": "mixed", "frames": 3, "seed": 15},
}


def blocks(image):
    """The means of blocks of 16 x 16 pixels, rows from the top."""
    height, width = (side // 16 for side in image.shape[:2])
    return image[: 16 * height, : 16 * width].reshape(height, 16, width, -1).mean((1, 3))


def found(spec):
    """What is told of a frame: its known values, the means of its images, and single disparities."""
    frame = render_frame(spec)
    truth = next(csv.DictReader(io.StringIO(truth_csv([("a", spec)]).decode())))
    return {
        **{name: float(text) if text and text[-1].isdigit() else text for name, text in truth.items()},
        "calibration": [float(word) for word in calibration(spec).decode().split() if word[-1] != ":"],
        "left": blocks(frame.left),
        "right": blocks(frame.right),
        "disparity": frame.disparity[3::8, 5::12],
        "road": blocks(frame.road),
        **({} if frame.heights is None else {"heights": np.nan_to_num(frame.heights[3::6, 5::8], nan=-9)}),
    }


def results():
    """Frames by the name of what they show."""
    here = {}
    for name, options in DRAWN.items():
        specs = draw_specs(SimulateOptions(**{"frames": 1, **SMALL, **options}))
        here |= {f"{name} {number}": found(spec) for number, spec in enumerate(specs)}
    here["as it is"] = found(FrameSpec(size=(96, 80)))
    return here


@pytest.mark.slow
def test_frames_are_those_on_record():
    assert unlike_record("simulate", results(), 2e-4) == []
