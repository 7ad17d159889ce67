"""From the bytes of calibration files, and a user's numbers, to a calibration."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

from rollcli.errors import InputError, UsageError
from rollcli.rig.calibration import Calibration, CalibrationOptions
from rollcli.rig.formats import datasets, opencv, robots
from rollcli.rig.formats.fields import INSTEAD, Fields, File, has_key, has_text

Known = TypeVar("Known", Fields, Calibration)

MAX_BYTES = 1 << 20  # to be read of a file; real ones have a few thousand


class Format(NamedTuple):
    """How a format is recognised, and how one file of it is read.

    `files` is how many files make a calibration at most: `read` takes so many.
    """

    name: str
    recognise: Callable[[File], bool]
    read: Callable[..., Fields]
    files: int = 1


# the first that recognises a file reads it: ORB-SLAM's settings can hold OpenCV's matrices, Kalibr's ROS's
FORMATS = (
    Format("KITTI", datasets.is_kitti, datasets.read_kitti),
    Format("DrivingStereo", has_key(":", *datasets.DRIVING_STEREO), datasets.read_driving_stereo),
    Format("Middlebury or ETH3D", has_key("=", "cam0"), datasets.read_middlebury),
    Format("ORB-SLAM", has_key(":", "Camera.bf", "Stereo.b", "Stereo.T_c1_c2"), robots.read_orb_slam),
    Format("Kalibr", has_key(":", "T_cn_cnm1"), robots.read_kalibr),
    Format("ROS camera_info", has_key(":", "projection_matrix"), robots.read_ros, files=2),
    Format("OpenCV stereoRectify", opencv.is_opencv, opencv.read_opencv),
    Format("Cityscapes", has_text('"intrinsic"', '"u0"'), datasets.read_cityscapes),
    Format("ZED", has_text("[LEFT_CAM_"), robots.read_zed),
)


def parse_calibration(files: Sequence[tuple[str, bytes]], given: CalibrationOptions) -> Calibration:
    """Read a calibration.

    Parameters
    ----------
    files : sequence of (name, data)
        One file of any format of `FORMATS`, two for ROS (left, right), or none.
    given : CalibrationOptions
        Numbers that win over those of the files.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        A file is of no known format, damaged, or contradicts itself.
    UsageError
        Numbers are missing or cannot be those of a rig; the message says which options to add.
    """
    fields = _read([_text(name, data) for name, data in files]) if files else Fields()
    source = " and ".join(name for name, _ in files)
    return _complete(_overridden(fields, given), _source(source, given), source)


def with_numbers(calibration: Calibration, given: CalibrationOptions) -> Calibration:
    """Return the calibration that a bag holds, with a user's numbers in place of its own.

    Raises
    ------
    UsageError
        They cannot be those of a rig.
    """
    return _overridden(replace(calibration, source=_source(calibration.source, given)), given)


def _source(files: str, given: CalibrationOptions) -> str:
    numbers = zip(given._fields[1:], given[1:], strict=True)
    options = [f"--{name.replace('_', '-')}" for name, value in numbers if value is not None]
    return ", ".join(filter(None, [files, *options]))


def _text(name: str, data: bytes) -> File:
    try:
        return File(name, data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise InputError(f"{name}: is not text, so it is no calibration; {INSTEAD}") from None


def _read(files: Sequence[File]) -> Fields:
    forms = []
    for file in files:
        form = next((each for each in FORMATS if each.recognise(file)), None)
        if form is None:
            known = ", ".join(each.name for each in FORMATS)
            raise file.error(f"is no calibration of a known format ({known}); {INSTEAD}")
        forms.append(form)
    if len(files) > min(form.files for form in forms) or len(set(forms)) > 1:
        raise files[1].error("only a pair of ROS camera_info files is given as two --calib; give one file")
    return forms[0].read(*files)


def _overridden(known: Known, given: CalibrationOptions) -> Known:
    cx, cy = given.principal_point or (None, None)
    numbers: dict[str, Any] = {"fx": given.focal, "cx": cx, "cy": cy, "doffs": given.doffs}
    if given.focal is not None:  # pixels are as high as the file says, if it does
        numbers["fy"] = given.focal * (known.fy / known.fx if known.fx and known.fy else 1.0)
    if given.baseline is not None:  # what the file's notes say is about its own one
        numbers |= {"baseline": given.baseline, "notes": ()}
    return replace(known, **{name: value for name, value in numbers.items() if value is not None})


def _complete(fields: Fields, source: str, file: str) -> Calibration:
    """Return the calibration; refuse one without what a pose needs."""
    missing = ["--focal PX"] if fields.fx is None else []
    missing += ["--principal-point CX,CY"] if fields.cx is None else []
    missing += ["--baseline M"] if fields.baseline is None and fields.lacks else []
    if missing:
        start = f"{file}: {fields.lacks or 'says too little'}" if file else "the calibration is not complete"
        raise UsageError(f"{start}; add {' and '.join(missing)}")
    known = {name: value for name, value in vars(fields).items() if name != "lacks"}
    return Calibration(**{**known, "doffs": fields.doffs or 0.0}, source=source)
