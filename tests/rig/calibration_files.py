"""The same rig written in every format, by hand, and samples of real files, from `samples`."""

from pathlib import Path
from string import Template
from typing import NamedTuple

_SAMPLES = {path.stem: path.read_text("utf-8") for path in Path(__file__).with_name("samples").iterdir()}


class Rig(NamedTuple):
    """A rectified pair: pixels, metres."""

    fx: float = 707.0912
    fy: float = 707.0912
    cx: float = 601.8873
    cy: float = 183.1104
    baseline: float = 0.5372
    doffs: float = 0.0
    width: int = 1226
    height: int = 370


def written(form, rig, **others):
    """The text of a sample with the numbers of a rig in it."""
    bf = rig.fx * rig.baseline
    more = {"right_cx": rig.cx + rig.doffs, "bf": bf, "shift": -bf, "baseline_mm": 1000 * rig.baseline}
    more |= {"per_baseline": 1 / rig.baseline, "doffs_per_baseline": rig.doffs / rig.baseline}
    return Template(_SAMPLES[form]).substitute(rig._asdict(), **more, **others)


def ros(rig, *, right, positive=False):
    """One of the two files of ROS; `positive` is a sign of the shift that some drivers write."""
    shift = rig.fx * rig.baseline * (1 if positive else -1) if right else 0.0
    side = {"side": "right" if right else "left", "side_cx": rig.cx + (rig.doffs if right else 0)}
    return written("ros", rig, side_shift=shift, **side)


WHOLE = (
    *("kitti-benchmark", "kitti-raw", "driving-stereo", "middlebury"),
    *("opencv-yaml", "orb-slam", "cityscapes"),
)
WITH_SIZE = ("kitti-raw", "driving-stereo", "middlebury", "orb-slam")
WITHOUT_DOFFS = ("orb-slam", "cityscapes")

# real files, shortened
KITTI_OBJECT, KITTI_RAW, MIDDLEBURY, OPENCV, ROS_RIGHT, KALIBR = (
    _SAMPLES[f"real-{name}"]
    for name in ("kitti-object", "kitti-raw", "middlebury", "opencv", "ros-right", "kalibr")
)
ROS_LEFT = ROS_RIGHT.replace("41.954632", "0").replace("right", "left")
