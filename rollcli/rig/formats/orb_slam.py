"""ORB-SLAM 2 and 3: settings with Camera.fx ... and Camera.bf = fx baseline, or, in 3's new form, Stereo.b.

The numbers are those of the images that the settings are for, raw or rectified.
"""

import re

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, number, size
from rollcli.rig.plain_yaml import parse_yaml

_KEY = re.compile(r"^[ \t]*(?:Camera\.bf|Stereo\.b)[ \t]*:", re.MULTILINE)


def is_orb_slam(text: str) -> bool:
    """Tell whether a text is a file of settings for stereo."""
    return _KEY.search(text) is not None


def read_orb_slam(file: File) -> Fields:
    """Read the camera and the baseline."""
    values = parse_yaml(file.text, file.name)

    def read(*keys: str) -> float:
        for key in keys:
            if key in values:
                return number(values[key], f"{file.name}: {key}")
        raise InputError(f"{file.name}: has no {keys[0]}")

    fx, fy, cx, cy = (read(f"Camera.{each}", f"Camera1.{each}") for each in ("fx", "fy", "cx", "cy"))
    if fx == 0:
        raise InputError(f"{file.name}: Camera.fx is 0: a focal length is more")
    baseline = read("Camera.bf") / fx if "Camera.bf" in values else read("Stereo.b")
    width = height = None
    if "Camera.width" in values and "Camera.height" in values:
        width, height = size(values["Camera.width"], values["Camera.height"], f"{file.name}: Camera.width")
    return Fields("ORB-SLAM", fx, fy, cx, cy, baseline, 0.0, width, height)
