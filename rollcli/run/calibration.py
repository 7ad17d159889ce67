"""The calibration of each frame: one for all, or one of the same stem each."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from rollcli.errors import InputError, UsageError
from rollcli.files.atomic import is_file
from rollcli.files.containers import frame_name
from rollcli.files.search import is_place, objects_behind
from rollcli.files.storage import fetch_all, read_bytes
from rollcli.files.stores.locations import is_url, public_name
from rollcli.rig.calibration import Calibration, CalibrationOptions, require_calibration
from rollcli.rig.read_calibration import MAX_BYTES, parse_calibration
from rollcli.run.frame import Frame
from rollcli.run.options import EncodingOptions, FrameOptions

_MARK = "_camera"  # Cityscapes: aachen_000000_000019_camera.json


def read_calibration(path: str | os.PathLike[str], *right: str | os.PathLike[str]) -> Calibration:
    """Read the calibration of a rectified stereo pair.

    Parameters
    ----------
    path : str or path
        A file of KITTI, Middlebury, ETH3D, OpenCV, ROS, Cityscapes, ORB-SLAM or DrivingStereo, recognised by
        its content.
    *right : str or path
        The file of the right view, where each view has one (ROS).

    Returns
    -------
    Calibration
        Lengths in metres, the rest in pixels.

    Raises
    ------
    InputError
        A file cannot be read, is of no known format, or contradicts itself.
    UsageError
        What it says is not enough for a pose, or cannot be a rig.

    Examples
    --------
    A calibration in KITTI's form, of cameras half a metre apart:

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp(), "calib.txt")
    >>> left, right = "700 0 600 0 0 700 180 0 0 0 1 0", "700 0 600 -350 0 700 180 0 0 0 1 0"
    >>> characters = file.write_text(f"P0: {left}\\nP1: {right}\\n")
    >>> found = read_calibration(file)
    >>> found.fx, found.cy, found.baseline
    (700.0, 180.0, 0.5)
    """
    return _read([os.fspath(each) for each in (path, *right)], CalibrationOptions())


def given_calibration(calibration: Calibration | str | os.PathLike[str] | None) -> Calibration | None:
    """Return the calibration that was given as it is, or as the path of its file; see `read_calibration`."""
    if isinstance(calibration, str | os.PathLike):
        return read_calibration(calibration)
    require_calibration(calibration)
    return calibration


class Calibrations:
    """What a user said of the calibration, found and read.

    Raises
    ------
    UsageError, InputError
        See `parse_calibration`; or there is no such file.
    """

    def __init__(self, given: CalibrationOptions) -> None:
        self.given = given.given
        self._given = given
        self._by_stem: dict[str, list[str]] | None = None
        self._fetched: dict[str, bytes] = {}  # of an object store, where one after the other takes long
        self._one: Calibration | None = None
        self._of_path: dict[str, Calibration] = {}  # one may be for a thousand frames
        if len(given.calib) == 1 and is_place(given.calib[0]):
            files = _files(given.calib[0])
            self._by_stem = _stems(files)
            self._fetched = fetch_all(filter(is_url, files), MAX_BYTES)
        elif given.given:
            self._one = _read(given.calib, given)

    def of(self, name: str) -> Calibration | None:
        """Return the calibration of a frame: of its stem, or of the stem up to one of its underscores."""
        if self._by_stem is None:
            return self._one
        folder, stem = self._given.calib[0], PurePosixPath(frame_name(name)).stem
        shorter = stem  # KITTI's 000010.txt is for 000010_10.png
        while shorter not in self._by_stem:
            shorter = shorter.rpartition("_")[0]
            if not shorter:
                raise UsageError(f"{name}: has no calibration of its name in {folder}")
        paths = self._by_stem[shorter]
        if len(paths) > 1:
            raise UsageError(f"{name}: has more than one calibration of its name: {paths[0]}, {paths[1]}")
        if paths[0] not in self._of_path:
            self._of_path[paths[0]] = _read([paths[0]], self._given, self._fetched)
        return self._of_path[paths[0]]


def calibration_files(given: CalibrationOptions) -> list[str]:
    """List the files that a user named, those of a folder one by one."""
    return [path for name in given.calib for path in (_files(name) if is_place(name) else [name])]


def calibration_notes(frames: Sequence[Frame]) -> list[str]:
    """List what the user should know about how the calibrations were read, each once."""
    used = dict.fromkeys(frame.calibration for frame in frames if frame.calibration is not None)
    return list(dict.fromkeys(note for calibration in used for note in calibration.notes))


def check_first_size(frames: Sequence[Frame], options: FrameOptions) -> list[str]:
    """Refuse a calibration that is not for the size of the first frame; say what speaks against its size.

    Raises
    ------
    UsageError
        So it is; or views side by side seem squeezed, and no calibration says that they are not.
    """
    first = next((frame for frame in frames if frame.calibration is not None or options.side_by_side), None)
    if first is None:
        return []
    from rollcli.files.formats import read_stored  # only here does a dispatcher decode an image
    from rollcli.run.read import read_views

    try:
        if first.right_file:
            height, width = read_views(first, options)[0].shape[:2]
        else:
            height, width = read_stored(
                options.at(first.path), first.file, rgb=options.encoding.encoding == "foundationstereo"
            ).values.shape
    except InputError:
        return []  # its row will say so
    if first.calibration is None:
        if width < height and options.side_by_side == "left-right":
            raise UsageError(
                f"{first.file}: its views would be {width}x{height} px, higher than wide, as where both are "
                "squeezed into one image, which changes angles: stretch them to twice their width, or give "
                "--calib, or --focal and --principal-point, of the views as they are"
            )
        return []
    doubt = first.calibration.seems_of_another_size(width, height)
    if doubt:
        return [doubt]
    first.calibration.for_size(width, height)
    return []


def check_depth(frames: Sequence[Frame], encoding: EncodingOptions) -> None:
    """Refuse depth maps without the calibration that turns their numbers into disparities.

    Raises
    ------
    UsageError
    """
    if encoding.encoding != "depth":
        return
    for frame in frames:
        if frame.calibration is None or frame.calibration.baseline is None:
            raise UsageError(
                "--encoding depth needs a focal length and a baseline, which turn a depth into a disparity: "
                "give --calib, or --focal, --principal-point and --baseline"
            )


def _stems(files: Sequence[str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for path in files:
        found.setdefault(PurePosixPath(path).stem.removesuffix(_MARK), []).append(path)
    return found


def _files(folder: str) -> list[str]:
    if is_url(folder):
        return sorted(path for path, _ in objects_behind(folder, recursive=True))
    found = (path for path in Path(folder).rglob("*") if is_file(path) and not path.name.startswith("."))
    return [str(path) for path in sorted(found)]


def _read(
    paths: Sequence[str], given: CalibrationOptions, fetched: Mapping[str, bytes] | None = None
) -> Calibration:
    if len(paths) > 2:
        raise UsageError("--calib is given at most twice: for the left and the right view of ROS")
    fetched = fetched or {}
    files = [(public_name(path), fetched.get(path) or read_bytes(path, most=MAX_BYTES)) for path in paths]
    return parse_calibration(files, given)
