"""A folder of rendered frames with their truth and calibration, the same bytes whatever the workers."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import OutputError, UsageError
from rollcli.files.atomic import output_error, remove_leftovers, write_atomic
from rollcli.files.encodings import from_disparity
from rollcli.files.formats import encode_stored
from rollcli.parallel.in_order import Work
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.run_tasks import Workers, run_tasks
from rollcli.simulate.draw import draw_specs
from rollcli.simulate.geometry.camera import rig_axes
from rollcli.simulate.options import CROSSFALL, KERB, KERBED, MIXED, SimulateOptions
from rollcli.simulate.render import render_frame
from rollcli.simulate.spec import LEVEL, FrameSpec
from rollcli.simulate.truth import calibration, truth_csv

_PARTS = ("left", "right", "disparity")
_TRUTH = "truth.csv"
_CALIBRATION = "calib"
_OURS = re.compile(r"frame_\d{4,}\.png")
KITTI_TOP = 65534 / 256  # pixels: larger disparities are written as no data


@dataclass(frozen=True)
class RenderTask:
    """A frame to render and the names of its files."""

    spec: FrameSpec
    folder: Path
    stem: str

    def image(self, part: str) -> Path:
        """The file of "left", "right" or "disparity"."""
        return self.folder / part / f"{self.stem}.png"


@dataclass(frozen=True)
class Dataset:
    """Which frames are written, and where."""

    folder: Path
    specs: tuple[FrameSpec, ...]

    @property
    def tasks(self) -> list[RenderTask]:
        """The frames with their names: frame_0001, frame_0002, ..."""
        digits = max(4, len(str(len(self.specs))))
        return [
            RenderTask(spec, self.folder, f"frame_{number:0{digits}d}")
            for number, spec in enumerate(self.specs, 1)
        ]

    @property
    def nearest_disparity(self) -> float:
        """The largest disparity of a flat road in any frame, pixels."""
        return max(_nearest_disparity(spec) for spec in self.specs)

    def calibrations(self) -> dict[Path, bytes]:
        """Files and contents: calib.txt where all frames share a rig, else one in calib/ for each frame."""
        contents = {task.stem: calibration(task.spec) for task in self.tasks}
        if len(set(contents.values())) == 1:
            return {self.folder / f"{_CALIBRATION}.txt": next(iter(contents.values()))}
        return {self.folder / _CALIBRATION / f"{stem}.txt": text for stem, text in contents.items()}

    def files(self) -> list[Path]:
        """Everything that is written, truth.csv last."""
        images = (task.image(part) for task in self.tasks for part in _PARTS)
        return [*images, *self.calibrations(), self.folder / _TRUTH]


def plan_dataset(folder: str | Path, options: SimulateOptions, *, overwrite: bool = False) -> Dataset:
    """Draw the frames and see that they can be written.

    Parameters
    ----------
    folder : str or Path
        Where to write; made if it is not there.
    options : SimulateOptions
        What to render.
    overwrite : bool
        Whether a folder with files in it may be written to.

    Raises
    ------
    UsageError
        Options that contradict each other, or a folder with files in it.
    """
    _refuse_idle(options)
    specs = draw_specs(
        options.frames,
        scene=options.scene,
        roll=_radians(options.roll_deg),
        pitch=_radians(options.pitch_deg),
        curvature=options.curvature,
        cross_section=options.cross_section,
        crossfall=_shares(options.crossfall or CROSSFALL),
        gutter=_shares(options.gutter),
        kerb=options.kerb or KERB,
        size=options.size,
        focal=options.focal,
        baseline=options.baseline,
        height=options.height,
        principal_point=options.principal_point,
        principal_offset=options.principal_offset,
        noise=options.noise,
        gain=options.gain,
        colour=not options.grey,
        seed=options.seed,
    )
    _require_free(Path(folder), overwrite)
    return Dataset(Path(folder), tuple(specs))


def _refuse_idle(options: SimulateOptions) -> None:
    """Refuse options that change nothing in the frames that are asked for."""
    if options.crossfall is not None and options.cross_section == "flat":
        raise UsageError("--crossfall: a flat road has none; choose another --cross-section")
    if options.kerb is not None and options.scene not in (*KERBED, MIXED):
        raise UsageError(f"--kerb: the scene {options.scene} has no kerbs; {' and '.join(KERBED)} have")


def write_dataset(dataset: Dataset, jobs: int | None = 1, stop: Stop | None = None) -> Iterator[str]:
    """Render and write the frames; yields each one's stem once it is on disk, in order.

    Frames of an earlier simulation in the same folder are removed first. truth.csv comes last: until it is
    there, the folder is not complete.

    Parameters
    ----------
    dataset : Dataset
    jobs : int or None
        Worker processes; None: the usable processors.
    stop : Stop, optional
        No frame is begun once this is asked for; truth.csv then is not written.

    Raises
    ------
    OutputError
        A file cannot be written, or a worker died.
    """
    _clear(dataset)
    remove_leftovers(task.image(part) for part in _PARTS for task in dataset.tasks)
    written = 0
    for stem in run_tasks(dataset.tasks, Work(_write_frame, _lost), stop or Stop(), Workers(jobs)):
        written += 1
        yield stem
    if written == len(dataset.specs):
        for path, text in dataset.calibrations().items():
            write_atomic(path, text)
        write_atomic(dataset.folder / _TRUTH, truth_csv((task.stem, task.spec) for task in dataset.tasks))


def _write_frame(task: RenderTask) -> str:
    frame = render_frame(task.spec)
    write_atomic(task.image("left"), _png(frame.left))
    write_atomic(task.image("right"), _png(frame.right))
    near = frame.disparity > KITTI_TOP
    stored = from_disparity(np.where(near, 0, frame.disparity), "kitti", np.uint16)
    write_atomic(task.image("disparity"), encode_stored(stored, "png"))
    return task.stem


def _lost(task: RenderTask, reason: str) -> str:
    raise OutputError(f"{task.image('left')}: cannot be rendered: {reason}; try fewer --jobs")


def _nearest_disparity(spec: FrameSpec) -> float:
    """The largest disparity of a flat road: at a corner of the image, as it changes evenly along each row."""
    right, down, ahead = rig_axes(spec.roll, spec.pitch, LEVEL) @ -LEVEL
    scale = spec.baseline / spec.height
    return max(
        scale * float(right * (u - spec.centre[0]) + down * (v - spec.centre[1]) + ahead * spec.focal)
        for u in (0, spec.size[0] - 1)
        for v in (0, spec.size[1] - 1)
    )


def _png(image: NDArray[np.uint8]) -> bytes:
    # noise hardly compresses: more effort than 1 only takes time
    _, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return data.tobytes()


def _require_free(folder: Path, overwrite: bool) -> None:
    try:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"{folder}: is a file, not a folder to write to")
        if not overwrite and folder.is_dir() and any(folder.iterdir()):
            raise UsageError(f"{folder}: there are files in it; --overwrite writes there all the same")
    except OSError as error:
        raise output_error(folder, error) from error


def _clear(dataset: Dataset) -> None:
    """Remove what an earlier simulation left: pairs without a row, and the calibration of another rig."""
    single = [dataset.folder / name for name in (_TRUTH, f"{_CALIBRATION}.txt")]
    try:
        for path in (*single, *_earlier_frames(dataset.folder)):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise output_error(dataset.folder, error) from error


def _earlier_frames(folder: Path) -> list[Path]:
    """What looks like ours: frame_0001.png and so on, where left, right and disparity all have it, and its
    calibration."""
    folders = [folder / part for part in _PARTS]
    if not all(each.is_dir() for each in folders):
        return []
    names = set.intersection(*({path.name for path in each.iterdir()} for each in folders))
    ours = [name for name in names if _OURS.fullmatch(name)]
    calibrations = [(folder / _CALIBRATION / name).with_suffix(".txt") for name in ours]
    return [each / name for name in ours for each in folders] + calibrations


def _shares(percent: Sequence[float]) -> tuple[float, float]:
    return percent[0] / 100, percent[1] / 100


def _radians(span: Sequence[float]) -> tuple[float, float]:
    return math.radians(span[0]), math.radians(span[1])
