"""Cityscapes: *_camera.json with intrinsic {fx, fy, u0, v0} and extrinsic {baseline}, metres.

Cordts et al., "The Cityscapes dataset", CVPR 2016, and its calibration.pdf.
"""

from rollcli.errors import InputError
from rollcli.rig.formats.fields import Fields, File, number
from rollcli.rig.formats.opencv import json_values


def is_cityscapes(text: str) -> bool:
    """Tell whether a text is such a calibration."""
    return '"intrinsic"' in text and '"u0"' in text


def read_cityscapes(file: File) -> Fields:
    """Read the camera and the baseline."""
    values = json_values(file)
    tables = [values.get(key) for key in ("intrinsic", "extrinsic")]
    found = []
    for table, keys in zip(tables, (("fx", "fy", "u0", "v0"), ("baseline",)), strict=True):
        for key in keys:
            if not isinstance(table, dict) or key not in table:
                raise InputError(f"{file.name}: has no {key}")
            found.append(number(table[key], f"{file.name}: {key}"))
    fx, fy, cx, cy, baseline = found
    return Fields("Cityscapes", fx, fy, cx, cy, baseline, 0.0)
