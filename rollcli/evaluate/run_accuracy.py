"""`evaluate accuracy` from the command line: what is read and written, and what is said meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rollcli.errors import ExitStatus
from rollcli.evaluate.accuracy import Accuracy, assess
from rollcli.evaluate.accuracy_text import FORMATS
from rollcli.evaluate.pose_accuracy import assess_height, assess_pitch
from rollcli.evaluate.truth import KnownPose, read_known_poses
from rollcli.files.matching import stem_of
from rollcli.files.naming import listed
from rollcli.files.results import Row, read_result
from rollcli.files.stream import is_stream, write_output
from rollcli.frames.checks import check_writes, list_files
from rollcli.frames.options import RunningOptions
from rollcli.messages import say


def run_accuracy(result: str, truth: str, form: str, output: str, running: RunningOptions) -> ExitStatus:
    """Compare a result with known angles.

    Parameters
    ----------
    result, truth : str
        Files: what `rollcli estimate` wrote, and a CSV with `file`, `roll_deg` and, where known, `pitch_deg`
        and `height_m`.
    form : {"table", "csv", "json"}
    output : str
        A file, or "-" for stdout.
    running : RunningOptions

    Returns
    -------
    ExitStatus
        FRAMES_FAILED when a frame of the truth has no angle.

    Raises
    ------
    UsageError, InputError
        Exit status 2: a file is not what it should be, or nothing in them matches.
    OutputError
        Exit status 1.
    """
    writes = [] if is_stream(output) else [output]
    check_writes([result, truth], writes, overwrite=running.overwrite)
    if running.dry_run:
        list_files([((result, truth), writes)])
        return ExitStatus.DONE
    rows, known = read_result(result).rows, read_known_poses(truth)
    accuracy = assess(rows, {stem: pose.theta for stem, pose in known.items()}, result)
    accuracy = replace(accuracy, pitch=assess_pitch(rows, known), height=assess_height(rows, known))
    _name_unmatched(accuracy, result, truth, running)
    _count_bent(rows, known, truth, running)
    data = FORMATS[form](accuracy).encode("utf-8", "surrogateescape")
    write_output(output, data)
    return ExitStatus.FRAMES_FAILED if accuracy.no_angle else ExitStatus.DONE


def _name_unmatched(accuracy: Accuracy, result: str, truth: str, running: RunningOptions) -> None:
    """Say which frames could not be compared: the first few by name."""
    if running.quiet:
        return
    for names, where, what in (
        (accuracy.no_angle, truth, f"no angle in {result}"),
        (accuracy.no_truth, result, f"no known angle in {truth}"),
    ):
        if names:
            frames = "1 frame has" if len(names) == 1 else f"{len(names)} frames have"
            say(f"{where}: {frames} {what}: {listed(names)}")


def _count_bent(
    rows: Sequence[Row], known: Mapping[str, KnownPose], truth: str, running: RunningOptions
) -> None:
    """Say how many poses are not compared because the road bends away from that below the camera."""
    posed = (known.get(stem_of(row.file)) for row in rows if row.pitch_deg is not None)
    bent = sum(pose is not None and pose.bends for pose in posed)
    if bent and not running.quiet:
        frames = "1 frame, whose road bends" if bent == 1 else f"{bent} frames, whose roads bend"
        say(f"{truth}: pitch and height are not compared on {frames} (curvature_per_m)")
