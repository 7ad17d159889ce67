"""A folder of rendered frames with their truth and calibration, the same bytes whatever the workers."""

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import OutputError
from rollcli.files.atomic import output_error, remove_leftovers, write_atomic
from rollcli.files.codecs.tiff import encode_tiff
from rollcli.files.encodings import KITTI_TOP, from_disparity
from rollcli.files.formats import encode_stored
from rollcli.files.results import run_path
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.in_order import Workers
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.tasks import run_tasks
from rollcli.simulate.build import carriageway_of, road_camber
from rollcli.simulate.camera import rig_axes
from rollcli.simulate.lane import lane_points, lane_rolls
from rollcli.simulate.render import render_frame
from rollcli.simulate.spec import LEVEL, FrameSpec

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
    "roughness",
    "lane_lo_deg",
    "lane_hi_deg",
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
        lane = (f"{math.degrees(angle) + 0.0:.6f}" for angle in lane_rolls_of(spec))
        rows.writerow((stem, *angles, spec.scene, *rig, spec.seed, *road, spec.roughness or "", *lane))
    return text.getvalue().encode()


def lane_rolls_of(spec: FrameSpec) -> tuple[float, float]:
    """Return the least and the greatest roll of the lane ahead, radians, as a lidar tells them: `lane_rolls`.

    Of a flat and smooth road both are `FrameSpec.roll`.
    """
    carriageway, lane = carriageway_of(spec), lane_points()
    lane = lane._replace(
        weight=lane.weight * ((lane.lateral > carriageway.left) & (lane.lateral < carriageway.right))
    )
    height = np.array([carriageway.section.elevation(lateral) for lateral in lane.lateral.tolist()])
    if carriageway.relief is not None:
        height += carriageway.relief.height(lane.lateral, lane.z)
    course, camera = carriageway.course, spec.cameras(carriageway.normal)[0]
    right = lane.lateral + lane.z * (course.heading + course.bend / 2 * lane.z)
    points = np.array([right, height + course.curvature / 2 * lane.z**2, lane.z])
    return lane_rolls(camera.axes @ (points - camera.position[:, None]), lane)


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


_PARTS = ("left", "right", "disparity")
TRUTH = "truth.csv"
_CALIBRATION, _HEIGHTS = "calib", "heights"
_OURS = re.compile(r"frame_\d{4,}\.png")


@dataclass(frozen=True)
class RenderTask:
    """A frame to render and the names of its files."""

    spec: FrameSpec
    folder: Path
    stem: str

    def image(self, part: str) -> Path:
        """Name the file of "left", "right" or "disparity"."""
        return self.folder / part / f"{self.stem}.png"

    def images(self) -> list[Path]:
        """Name the files of the frame."""
        return [self.image(part) for part in _PARTS] + ([] if self.heights is None else [self.heights])

    @property
    def heights(self) -> Path | None:
        """Name the file of true heights; None where there is none."""
        return None if self.spec.dips is None else self.folder / _HEIGHTS / f"{self.stem}.tif"


@dataclass(frozen=True)
class Dataset:
    """Which frames are written, and where.

    `record` holds the version and the options for a later --resume; `kept` the stems that an interrupted
    simulation has left whole, or None where the folder is begun anew.
    """

    folder: Path
    specs: tuple[FrameSpec, ...]
    record: Mapping[str, Any] | None = None
    kept: frozenset[str] | None = None

    @property
    def tasks(self) -> list[RenderTask]:
        """The frames with their names: frame_0001, frame_0002, ..."""
        digits = max(4, len(str(len(self.specs))))
        return [
            RenderTask(spec, self.folder, f"frame_{number:0{digits}d}")
            for number, spec in enumerate(self.specs, 1)
        ]

    @property
    def missing(self) -> list[RenderTask]:
        """The frames that are not there yet."""
        return [task for task in self.tasks if task.stem not in (self.kept or ())]

    @property
    def nearest_disparity(self) -> float:
        """The largest disparity of a flat road in any frame, pixels."""
        return max(_nearest_disparity(spec) for spec in self.specs)

    def calibrations(self) -> dict[Path, bytes]:
        """Make names and contents: calib.txt where all frames share a rig, else one a frame in calib/."""
        contents = {task.stem: calibration(task.spec) for task in self.tasks}
        if len(set(contents.values())) == 1:
            return {self.folder / f"{_CALIBRATION}.txt": next(iter(contents.values()))}
        return {self.folder / _CALIBRATION / f"{stem}.txt": text for stem, text in contents.items()}

    def files(self) -> list[Path]:
        """List all files that are written, truth.csv last."""
        record = [] if self.record is None else [Path(run_path(self.folder / TRUTH))]
        images = (path for task in self.missing for path in task.images())
        return [*record, *images, *self.calibrations(), self.folder / TRUTH]


def write_dataset(dataset: Dataset, jobs: int | None = 1, stop: Stop | None = None) -> Iterator[str]:
    """Render and write the frames that are missing; yield the stem of each once it is on disk, in order.

    Unless frames are kept, those of an earlier simulation in the folder are removed first. truth.csv is
    written last: until it is there, the folder is not complete.

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
    if dataset.kept is None:
        _clear(dataset)
    if dataset.record is not None:
        text = json.dumps(dataset.record, indent=2).encode() + b"\n"
        write_atomic(run_path(dataset.folder / TRUTH), text)
    tasks, written = dataset.missing, 0
    remove_leftovers(path for task in tasks for path in task.images())
    work = Work(_write_frame, _lost, lambda task: remove_leftovers(task.images()))
    for stem in run_tasks(tasks, work, stop or Stop(), Workers(jobs)):
        written += 1
        yield stem
    if written == len(tasks):
        for path, text in dataset.calibrations().items():
            write_atomic(path, text)
        write_atomic(dataset.folder / TRUTH, truth_csv((task.stem, task.spec) for task in dataset.tasks))


def _write_frame(task: RenderTask) -> str:
    frame = render_frame(task.spec)
    write_atomic(task.image("left"), _png(frame.left))
    write_atomic(task.image("right"), _png(frame.right))
    near = frame.disparity > KITTI_TOP
    stored = from_disparity(np.where(near, 0, frame.disparity), "kitti", np.uint16)
    write_atomic(task.image("disparity"), encode_stored(stored, "png"))
    if task.heights is not None and frame.heights is not None:
        write_atomic(task.heights, encode_tiff(frame.heights, description="height over the road, metres"))
    return task.stem


def _lost(task: RenderTask, reason: str) -> str:
    raise OutputError(f"{task.image('left')}: cannot be rendered: {reason}; try fewer --jobs")


def _nearest_disparity(spec: FrameSpec) -> float:
    """Return the largest disparity of a flat road, which is linear in the image: largest in one corner."""
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


def _clear(dataset: Dataset) -> None:
    """Remove what an earlier simulation left: pairs without a row, and the calibration of another rig."""
    single = [dataset.folder / name for name in (TRUTH, f"{_CALIBRATION}.txt")]
    try:
        for path in (*single, *_earlier_frames(dataset.folder)):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise output_error(dataset.folder, error) from error


def _earlier_frames(folder: Path) -> list[Path]:
    """List the files of frame_0001 and so on, where left, right and disparity all have it."""
    folders = [folder / part for part in _PARTS]
    if not all(each.is_dir() for each in folders):
        return []
    names = set.intersection(*({path.name for path in each.iterdir()} for each in folders))
    ours = [name for name in names if _OURS.fullmatch(name)]
    calibrations = [(folder / _CALIBRATION / name).with_suffix(".txt") for name in ours]
    heights = [(folder / _HEIGHTS / name).with_suffix(".tif") for name in ours]
    return [each / name for name in ours for each in folders] + calibrations + heights
