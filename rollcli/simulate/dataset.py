"""`rollcli simulate`: a folder of rendered frames with their truth and calibration.

Its bytes are the same whatever the workers.
"""

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli import __version__
from rollcli.errors import ExitStatus, InputError, OutputError, UsageError, writing
from rollcli.files.atomic import is_there, remove_leftovers, write_atomic
from rollcli.files.encodings import KITTI_TOP, to_kitti
from rollcli.files.formats import encode_stored
from rollcli.files.locking import differences, not_resumable
from rollcli.files.results import csv_table, read_run, run_path
from rollcli.files.stores.locations import require_local
from rollcli.messages import say
from rollcli.run.options import RunningOptions
from rollcli.run.outputs import Existing, list_files
from rollcli.run.progress import TaskProgress
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import Stop, stop_on_signals
from rollcli.run.workers.tasks import run_tasks
from rollcli.simulate.build import carriageway_of, render_frame, road_camber
from rollcli.simulate.options import KERBED, MIXED, TRUTH, SimulateOptions
from rollcli.simulate.relief import lane_points, lane_rolls
from rollcli.simulate.spec import FrameSpec, draw_specs

_VIEWS, _HEIGHTS, _CALIBRATION = ("left", "right", "disparity"), "heights", "calib"
_ENDINGS = {**dict.fromkeys(_VIEWS, "png"), _HEIGHTS: "tif", _CALIBRATION: "txt"}
_OURS = re.compile(r"frame_\d{4,}")


def truth_csv(frames: Iterable[tuple[str, FrameSpec]]) -> bytes:
    """Write the table of known values, one row for each stem and its frame."""
    rows = [{"file": stem, **_truth_of(spec)} for stem, spec in frames]
    return csv_table([rows[0], *(row.values() for row in rows)])


def _truth_of(spec: FrameSpec) -> dict[str, str | int]:
    low, high = lane_rolls_of(spec)
    carriageway = carriageway_of(spec)
    return {
        "roll_deg": _degrees(spec.roll, 9),
        "pitch_deg": _degrees(spec.pitch, 9),
        "scene": spec.scene,
        "focal_px": _number(spec.focal),
        "cx_px": _number(spec.centre[0]),
        "cy_px": _number(spec.centre[1]),
        "baseline_m": _number(spec.baseline),
        "height_m": _number(spec.height),
        "curvature_per_m": _number(carriageway.curvature_ahead),
        "seed": spec.seed,
        "cross_section": spec.cross_section,
        "crossfall_percent": _number(100 * spec.crossfall),
        "gutter_percent": _number(100 * spec.gutter),
        # a roof has a ridge instead of a curvature
        "camber": "" if spec.cross_section == "roof" else _number(road_camber(spec)),
        "bend_per_m": _number(carriageway.course.bend),
        "roughness": spec.roughness or "",
        "lane_lo_deg": _degrees(low, 6),
        "lane_hi_deg": _degrees(high, 6),
    }


def _number(value: float) -> str:
    return f"{value + 0.0:.10g}"  # + 0.0 turns -0.0 into 0


def _degrees(angle: float, digits: int) -> str:
    return f"{math.degrees(angle) + 0.0:.{digits}f}"


def lane_rolls_of(spec: FrameSpec) -> tuple[float, float]:
    """Return the least and the greatest roll of the lane ahead, radians, as a lidar tells them: `lane_rolls`.

    Of a flat and smooth road both are `FrameSpec.roll`.
    """
    carriageway, (lateral, z, weight) = carriageway_of(spec), lane_points()
    height = carriageway.section.elevation(lateral)
    if carriageway.relief is not None:
        height = height + carriageway.relief.height(lateral, z)
    camera = spec.cameras(carriageway.normal)[0]
    points = carriageway.course.point(lateral, z, height) - camera.position[:, None]
    on_road = (lateral > carriageway.left) & (lateral < carriageway.right)
    return lane_rolls(camera.axes @ points, lateral, z, weight * on_road)


def calibration(spec: FrameSpec) -> bytes:
    """Write the rectified projections of the left and the right view, P0 and P1 of KITTI's benchmarks.

    Both are 3x4, row by row, in pixels and metres; the fourth number of P1 is -focal * baseline. See Geiger,
    Lenz, Urtasun, "Are we ready for autonomous driving?", CVPR 2012.
    """
    text, (cx, cy), focal = "", spec.centre, spec.focal
    for i, fourth in enumerate((0.0, -focal * spec.baseline)):
        view = focal, 0.0, cx, fourth, 0.0, focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0
        text += f"P{i}: {' '.join(f'{x:.12e}' for x in view)}\n"
    return text.encode()


def _path(folder: Path, part: str, stem: str) -> Path:
    return folder / part / f"{stem}.{_ENDINGS[part]}"


class RenderTask(NamedTuple):
    """A frame to render and the names of its files."""

    spec: FrameSpec
    folder: Path
    stem: str

    @property
    def files(self) -> list[Path]:
        """The files of the frame: both views, the disparity and, where it has true ones, the heights."""
        parts = _VIEWS if self.spec.dips is None else (*_VIEWS, _HEIGHTS)
        return [_path(self.folder, part, self.stem) for part in parts]


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

    def calibrations(self) -> dict[Path, bytes]:
        """Make names and contents: calib.txt where all frames share a rig, else one a frame in calib/."""
        contents = {task.stem: calibration(task.spec) for task in self.tasks}
        if len(set(contents.values())) == 1:
            return {self.folder / f"{_CALIBRATION}.txt": next(iter(contents.values()))}
        return {_path(self.folder, _CALIBRATION, stem): text for stem, text in contents.items()}

    def files(self) -> list[Path]:
        """List all files that are written, truth.csv last."""
        record = [] if self.record is None else [Path(run_path(self.folder / TRUTH))]
        images = (path for task in self.missing for path in task.files)
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
    if dataset.kept is None:  # pairs without a row, another rig's calibration
        with writing(dataset.folder):
            for path in _earlier_files(dataset.folder):
                path.unlink(missing_ok=True)
    if dataset.record is not None:
        text = json.dumps(dataset.record, indent=2).encode() + b"\n"
        write_atomic(run_path(dataset.folder / TRUTH), text)
    tasks, written = dataset.missing, 0
    work = Work(_write_frame, _lost, _remove_leftovers)
    work.clear(tasks)
    for stem in run_tasks(tasks, work, stop or Stop(), Workers(jobs)):
        written += 1
        yield stem
    if written == len(tasks):
        for path, text in dataset.calibrations().items():
            write_atomic(path, text)
        write_atomic(dataset.folder / TRUTH, truth_csv((task.stem, task.spec) for task in dataset.tasks))


def _write_frame(task: RenderTask) -> str:
    frame = render_frame(task.spec)
    data = [_png(frame.left), _png(frame.right), encode_stored(to_kitti(frame.disparity), "png")]
    if frame.heights is not None:
        data.append(encode_stored(frame.heights, "tiff", text="height over the road, metres"))
    for path, content in zip(task.files, data, strict=True):
        write_atomic(path, content)
    return task.stem


def _lost(task: RenderTask, reason: str) -> str:
    raise OutputError(f"{task.files[0]}: cannot be rendered: {reason}; try fewer --jobs")


def _remove_leftovers(tasks: Iterable[RenderTask]) -> None:
    remove_leftovers(path for task in tasks for path in task.files)


def _png(image: NDArray[np.uint8]) -> bytes:
    # noise hardly compresses: more effort than 1 only takes time
    _, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return data.tobytes()


def _earlier_files(folder: Path) -> list[Path]:
    """List what a simulation writes: of frame_0001 and so on, where left, right and disparity all have it.

    One that has left its record may have ended amid a frame: there any of the three tells of it.
    """
    join = set.union if is_there(run_path(folder / TRUTH)) else set.intersection
    stems = join(*({path.stem for path in (folder / part).glob("*.png")} for part in _VIEWS))
    frames = [_path(folder, part, stem) for stem in filter(_OURS.fullmatch, stems) for part in _ENDINGS]
    return [folder / TRUTH, folder / f"{_CALIBRATION}.txt", *frames]


def plan_dataset(folder: str | Path, options: SimulateOptions, *, overwrite: bool = False) -> Dataset:
    """Draw the frames, and check that they can be written.

    Parameters
    ----------
    folder : str or Path
        Where to write; made if it does not exist.
    options : SimulateOptions
        What to render.
    overwrite : bool
        Whether to begin anew in a folder with files in it.

    Raises
    ------
    UsageError
        Options contradict each other, or the folder has files in it that may not be replaced or continued.
    """
    if options.resume and overwrite:
        raise UsageError("give either --resume or --overwrite")
    if options.crossfall is not None and options.cross_section == "flat":
        raise UsageError("--crossfall: a flat road has none; choose another --cross-section")
    if options.kerb is not None and options.scene not in (*KERBED, MIXED):
        raise UsageError(f"--kerb: the scene {options.scene} has no kerbs; {' and '.join(KERBED)} have")
    require_local(str(folder), "pairs are rendered to local disk: name a folder here, and upload it")
    dataset = Dataset(Path(folder), tuple(draw_specs(options)), _record(options))
    with writing(folder):
        if dataset.folder.exists() and not dataset.folder.is_dir():
            raise UsageError(f"{folder}: is a file, not a folder to write to")
        is_free = not dataset.folder.is_dir() or not any(dataset.folder.iterdir())
    if is_free or overwrite:
        return dataset
    if not options.resume:
        raise UsageError(
            f"{folder}: there are files in it; --resume continues an interrupted simulation, "
            "--overwrite begins anew"
        )
    _check_resumable(dataset)
    there = Existing(filled=True)  # a power cut leaves empty ones
    whole = (task.stem for task in dataset.tasks if all(str(path) in there for path in task.files))
    return replace(dataset, kept=frozenset(whole))


def _record(options: SimulateOptions) -> Mapping[str, Any]:
    """Collect what decides the bytes of the frames: the version, and the options by their names."""
    values = {key.removesuffix("_deg").replace("_", "-"): value for key, value in asdict(options).items()}
    del values["resume"]
    return {"rollcli": __version__, "options": values}


def _check_resumable(dataset: Dataset) -> None:
    """Refuse to continue a folder of another version, of other options or without a record.

    Raises
    ------
    UsageError
        Says what differs.
    """
    try:
        was = read_run(dataset.folder / TRUTH)
    except InputError:
        was = {}
    if was is None:
        found = f"there is no {run_path(TRUTH)}"
    elif isinstance(was.get("rollcli"), str) and isinstance(was.get("options"), dict):
        found = next(differences(was, dataset.record or {}), "")
    else:
        found = f"{run_path(TRUTH)} is damaged"
    if found:
        raise not_resumable(str(dataset.folder), found)


def run_simulate(
    folder: str, options: SimulateOptions, running: RunningOptions, resume_command: str = ""
) -> ExitStatus:
    """Write the simulated frames.

    Parameters
    ----------
    folder : str
        Where to write.
    options : SimulateOptions
        What to render.
    running : RunningOptions
        How to run, and how much to say.
    resume_command : str
        The command that continues this simulation when it is interrupted.

    Raises
    ------
    UsageError, OutputError
        Exit statuses 2 and 1.
    """
    dataset = plan_dataset(folder, options, overwrite=running.overwrite)
    if running.dry_run:
        list_files([((), map(str, dataset.files()))])
        return ExitStatus.DONE
    nearest = max(spec.nearest_disparity for spec in dataset.specs)
    if nearest > KITTI_TOP:
        running.note(
            f"the road reaches {nearest:.0f} px of disparity: what exceeds "
            f"{KITTI_TOP:.0f} px does not fit a KITTI PNG and has no data in {dataset.folder}/disparity"
        )
    progress = TaskProgress(len(dataset.specs), running)
    progress.kept = len(dataset.kept or ())
    # a second Ctrl-C does not wait for the frames that have begun
    with stop_on_signals() as stop, suppress(KeyboardInterrupt), progress:
        for stem in write_dataset(dataset, running.jobs, stop):
            progress.advance()
            progress.detail(f"{stem} written")
    if stop.at_once or progress.done < progress.total:
        say(f"interrupted after {progress.done} of {progress.total} frames; continue with: {resume_command}")
        return ExitStatus.INTERRUPTED
    rendered = progress.done - progress.kept
    cost = f", {progress.seconds / rendered:.2f} s a frame" if rendered else ""
    progress.note(f"{progress.frames()} in {dataset.folder}; {progress.seconds:.1f} s{cost}")
    return ExitStatus.DONE
