"""Decide and check what a run will read and write, before anything runs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

from rollcli.errors import UsageError
from rollcli.files.results import IMAGE_ROLL, TIMING, Format, require_utf8, run_path
from rollcli.files.storage import is_stream
from rollcli.rig.calibration import Calibration
from rollcli.run import outputs
from rollcli.run.find import calibration_files, check_depth, check_first_size, find_frames
from rollcli.run.frame import Frame
from rollcli.run.options import EstimateOptions, ResultOptions
from rollcli.run.result_file import inputs_path


@dataclass(frozen=True)
class Plan:
    """What a run is asked, its frames in the order of their rows, and further columns."""

    options: EstimateOptions
    frames: Sequence[Frame]
    further: tuple[str, ...] = ()

    @property
    def output(self) -> str:
        """Where the rows go."""
        output = self.options.result.output
        return output.rstrip("/") if self.options.result.in_parts else output

    @property
    def format(self) -> Format:
        """How the rows are written."""
        return self.options.result.form

    @property
    def files(self) -> list[str]:
        """The result, what its rows were made from, and the record of its run; none of these of a stream."""
        if is_stream(self.output):
            return []
        return [self.output, inputs_path(self.output), run_path(self.output)]


def make_plan(options: EstimateOptions) -> Plan:
    """Find the frames and check what can be checked before they run.

    Raises
    ------
    UsageError
        No input; pairs, masks or calibrations without partner; a calibration that is not for the images; two
        frames with the same image; an image or a result that would replace an input, or that exists already.
    """
    _check_start(options)
    frames = find_frames(options)
    check_depth(frames, options)
    plan = Plan(options, frames)
    if options.result.update and options.result.in_parts:
        raise UsageError(
            f"{plan.output}: rows of a result in parts (Parquet, or below a URL) keep their places: "
            "--update takes a result in one file of CSV or JSON Lines"
        )
    outputs.check_one_owner(frames, options.writes, plan.files)
    calibrations = calibration_files(options.calibration)
    outputs.check_inputs_are_kept(
        lambda: chain(calibrations, (path for frame in plan.frames for path in frame.reads())),
        chain(plan.files, outputs.files_of(plan.frames, options.writes)),
    )
    every, frames = frames, _shard(frames, options.result)
    outputs.check_places(frames, options.folders)
    further = _further_columns(every, check_first_size(every, options), options)
    if not (options.running.overwrite or options.result.resume):
        outputs.check_nothing_is_there(outputs.files_of(frames, options.writes))
    if plan.format == "parquet" and is_stream(plan.output):
        raise UsageError("Parquet is a folder of parts: name it with --output")
    if plan.format == "parquet" and not options.inputs.sorted:  # those are read as they are needed
        require_utf8(name for frame in frames for name in (frame.file, frame.right_file))
    return replace(plan, frames=frames, further=further)


def _check_start(options: EstimateOptions) -> None:
    """Refuse options that contradict each other or the inputs."""
    asked = options.result
    flag = "--update" if asked.update else "--resume"
    if asked.retry_failed and not asked.resume:
        raise UsageError("--retry-failed does again what failed in an earlier run: give --resume with it")
    if asked.resume and options.running.overwrite:
        raise UsageError(f"give either {flag} or --overwrite")
    if asked.resume and is_stream(asked.output):
        raise UsageError(f"{flag} needs a result file: name it with --output")
    if options.images.disparity is not None and not options.paired:
        raise UsageError("--disparity writes maps computed from --left and --right; here maps are the input")


def _further_columns(
    frames: Sequence[Frame], first: Calibration | None, options: EstimateOptions
) -> tuple[str, ...]:
    """List the columns that the result has beside those of every result; shards of a run have the same.

    `first` is the calibration of the first map, where known.
    """
    # of names that are read as they are needed, the first tells of all
    some = (frame.calibration for frame in (frames[:1] if options.inputs.sorted else frames))
    stretched = any(camera is not None and camera.fx != camera.fy for camera in chain([first], some))
    return (*((IMAGE_ROLL,) if stretched else ()), *((TIMING,) if options.result.timing else ()))


def _shard(frames: Sequence[Frame], options: ResultOptions) -> Sequence[Frame]:
    part, parts = options.shard
    if options.shard_by == "range":
        return frames[(part - 1) * len(frames) // parts : part * len(frames) // parts]
    return frames[part - 1 :: parts]
