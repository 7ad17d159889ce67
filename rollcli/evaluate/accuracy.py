"""`evaluate accuracy`: the angles, poses and heights over the road of a result against known ones."""

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import ExitStatus, InputError, UsageError
from rollcli.evaluate.options import AccuracyOptions
from rollcli.evaluate.truth import KnownPose, by_stem, read_truth
from rollcli.files.atomic import is_folder
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_stored
from rollcli.files.inputs import find_inputs, stem_of
from rollcli.files.results import Result, Row, csv_table, read_result, run_path
from rollcli.files.search import Search
from rollcli.files.storage import is_stream, write_output
from rollcli.messages import listed
from rollcli.run.outputs import listed_only
from rollcli.run.resume import recorded_options

LARGE_ERROR_DEG = 0.5
DISTANCES_M = (5, 10, 20)
_WITHIN = 0.2  # of a distance
_MOST = 50_000  # pixels of a frame at a distance: more would not change median, percentile and mean


@dataclass(frozen=True)
class Accuracy:
    """How far one quantity of a result is from known values: angles, degrees, or heights, metres.

    Attributes
    ----------
    count : int
        Frames compared: they have a value, and a known one. Of heights over the road each has many.
    median, p95, worst : float or None
        Of abs(error); None where nothing was compared.
    worst_file : str
        The frame of the worst.
    bias : float or None
        The mean error: of roll, a rig that is mounted askew shows here.
    share_above_0_5_deg : float or None
        Of the frames compared, from 0 to 1.
    coverage_95 : float or None
        Share of the known values inside their 95 % interval, among the frames that have one. An uneven lane
        has no one roll: a part of it has to be inside.
    intervals : int
        How many have one.
    """

    count: int = 0
    median: float | None = None
    p95: float | None = None
    worst: float | None = None
    worst_file: str = ""
    bias: float | None = None
    share_above_0_5_deg: float | None = None
    coverage_95: float | None = None
    intervals: int = 0


@dataclass(frozen=True)
class Comparison:
    """A result against known values.

    Attributes
    ----------
    roll : Accuracy
    ok, suspect : int
        The frames compared, by status.
    no_angle : tuple of str
        Frames of the truth for which the result has no angle, as an error row or not at all.
    no_truth : tuple of str
        Rows of the result whose angle is not known.
    pitch, height : Accuracy or None
        None where the truth or the result has none.
    heights : mapping of int to Accuracy
        Of the heights over the road by their distance along the optical axis, metres, give or take a fifth;
        empty where the truth or the run has none.
    """

    roll: Accuracy
    ok: int
    suspect: int
    no_angle: tuple[str, ...]
    no_truth: tuple[str, ...]
    pitch: Accuracy | None = None
    height: Accuracy | None = None
    heights: Mapping[int, Accuracy] = field(default_factory=dict)


def assess(rows: Sequence[Row], truth: Mapping[str, KnownPose], result_name: str) -> Comparison:
    """Compare a result with known angles, pitches and heights, matched by stem.

    Parameters
    ----------
    rows : sequence of Row
        The rows of a result.
    truth : mapping of str to KnownPose
        By stem; see `read_truth`.
    result_name : str
        What errors call the result.

    Returns
    -------
    Comparison
        Without heights over the road: see `assess_heights`.

    Raises
    ------
    UsageError
        No row matches a known angle, or two rows have the same stem.
    """
    found = by_stem((result_name, row.file, row) for row in rows)
    if not found.keys() & truth.keys():
        example = f": it holds {rows[0].file}, the truth {next(iter(truth))}" if rows else ": it is empty"
        raise UsageError(f"{result_name}: no row has the stem of a frame of the truth{example}")
    known = [(row, truth[stem]) for stem, row in found.items() if stem in truth]
    rolls = [
        (row, row.roll_deg, (math.degrees(pose.theta), *pose.lane_deg), row.roll_ci95_deg)
        for row, pose in known
    ]
    statuses = [row.status for row, _ in known if row.roll_deg is not None]
    return Comparison(
        roll=_accuracy(rolls, period=180) or Accuracy(),
        ok=statuses.count("ok"),
        suspect=statuses.count("suspect"),
        no_angle=tuple(s for s in truth if s not in found or found[s].roll_deg is None),
        no_truth=tuple(row.file for stem, row in found.items() if stem not in truth),
        pitch=_accuracy([(row, row.pitch_deg, (pose.pitch_deg,), row.pitch_ci95_deg) for row, pose in known]),
        height=_accuracy([(row, row.height_m, (pose.height_m,), row.height_ci95_m) for row, pose in known]),
    )


_Compared = tuple[Row, float | None, Sequence[float | None], float | None]


def _accuracy(compared: Sequence[_Compared], period: float = math.inf) -> Accuracy | None:
    """Sum up rows, each with its value, what is known of it, and the half-width of its interval.

    Known is a value, and after it the ends of a range, of which a part has to be in the interval. None where
    nothing is known.
    """
    found = []
    for row, value, known, half_width in compared:
        off = [  # angles half a turn apart are the same
            math.remainder(value - each, period) for each in known if value is not None and each is not None
        ]
        if off:
            found.append((row.file, off, half_width))
    if not found:
        return None
    errors = np.array([off[0] for _, off, _ in found])
    worst = int(np.abs(errors).argmax())
    inside = [
        min(off) <= half_width and max(off) >= -half_width
        for _, off, half_width in found
        if half_width is not None
    ]
    coverage = float(np.mean(inside)) if inside else None
    figures = _figures(errors, len(found))
    return replace(figures, worst_file=found[worst][0], coverage_95=coverage, intervals=len(inside))


def _figures(errors: NDArray[np.float64], count: int) -> Accuracy:
    """Sum up errors of so many frames."""
    sizes = np.abs(errors)
    return Accuracy(
        count=count,
        median=float(np.median(sizes)),
        p95=float(np.percentile(sizes, 95)),
        worst=float(sizes.max()),
        bias=float(errors.mean()),
        share_above_0_5_deg=float(np.mean(sizes > LARGE_ERROR_DEG)),
    )


def assess_heights(
    rows: Sequence[Row], known: Mapping[str, KnownPose], heights: str, truth: str, disparity: str
) -> dict[int, Accuracy] | None:
    """Compare the heights over the road with true ones at `DISTANCES_M`, matched by stem.

    Parameters
    ----------
    rows : sequence of Row
    known : mapping of str to KnownPose
        By stem.
    heights : str
        The folder that `estimate --heights` wrote.
    truth, disparity : str
        The folders of true heights and disparities, as `simulate` writes them.

    Returns
    -------
    dict of int to Accuracy, or None
        By distance, metres. One that no frame shows is left out. None where no frame has heights in metres
        and true ones.

    Raises
    ------
    UsageError
        A folder does not exist or holds no map.
    InputError
        A map cannot be read, or two of a frame differ in size.
    """
    folders = [
        {stem_of(each.name): each.location for each in find_inputs([folder], Search(recursive=True))}
        for folder in (heights, truth, disparity)
    ]
    errors: dict[int, list[NDArray[np.float64]]] = {distance: [] for distance in DISTANCES_M}
    worst = dict.fromkeys(DISTANCES_M, 0.0)
    compared = False
    for row in rows:
        stem = stem_of(row.file)
        rig = known.get(stem)
        if row.height_m is None or rig is None or rig.focal_baseline is None:
            continue
        if all(stem in folder for folder in folders):
            compared = True
            maps = [folder[stem] for folder in folders]
            for distance, found in _height_errors(maps, rig.focal_baseline):
                errors[distance].append(found[:: -(-len(found) // _MOST)])
                worst[distance] = max(worst[distance], float(np.abs(found).max()))
    if not compared:
        return None
    return {
        at: replace(_figures(np.concatenate(parts), len(parts)), worst=worst[at])
        for at, parts in errors.items()
        if parts
    }


def _height_errors(maps: Sequence[str], scale: float) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield the errors of a frame at each distance.

    `maps` are its heights, the true ones and the true disparity; `scale` is its focal length times its
    baseline, px m.
    """
    heights, truth = (read_stored(path).values.astype(np.float64) for path in maps[:2])
    disparity = read_disparity(maps[2])
    if not heights.shape == truth.shape == disparity.shape:
        shapes = (heights.shape, truth.shape, disparity.shape)
        sizes = ", ".join(f"{width}x{height}" for height, width in shapes)
        raise InputError(f"{maps[0]}: heights, true heights and true disparity differ in size: {sizes}")
    off = heights - truth
    with np.errstate(divide="ignore"):
        ahead = scale / disparity
    for distance in DISTANCES_M:
        found = off[np.isfinite(off) & (np.abs(ahead / distance - 1) < _WITHIN)]
        if len(found):
            yield distance, found


_DIGITS = 6
_OF_POSE = ("count", "median", "p95", "worst", "bias", "coverage_95")
# what has the unit of the quantity, in words
_LENGTHS = {"median": "median error", "p95": "95th percentile", "worst": "worst", "bias": "mean, signed"}


def as_table(found: Comparison) -> str:
    """Return one figure a line, for people."""
    roll = found.roll
    lines = [
        ("frames compared", f"{roll.count}" + (f" ({found.suspect} suspect)" if found.suspect else "")),
        ("without an angle", str(len(found.no_angle))),
        ("without a known angle", str(len(found.no_truth))),
        *_lines("", roll, "degrees"),
        (f"above {LARGE_ERROR_DEG:g} degrees", _percent(roll.share_above_0_5_deg, roll.count)),
        ("inside the 95 % interval", _percent(roll.coverage_95, roll.intervals)),
    ]
    for name, part, unit in (("pitch", found.pitch, "degrees"), ("height", found.height, "m")):
        if part is not None:
            lines += _lines(f"{name}, ", part, unit)
            lines.append((f"{name}, in its interval", _percent(part.coverage_95, part.intervals)))
    for distance, part in found.heights.items():
        lines += _lines(f"heights, {distance} m, ", part, "m")
    width = 2 + max(len(name) for name, _ in lines)
    return "".join(f"{name:{width}}{value}\n" for name, value in lines)


def _lines(name: str, part: Accuracy, unit: str) -> Iterator[tuple[str, str]]:
    """Yield the figures of a quantity in words; of roll, which has no name, with the frame of the worst.

    How many frames it is of is said of roll beside those that are left out.
    """
    if name:
        yield f"{name}frames compared", str(part.count)
    for figure, words in _LENGTHS.items():
        value, more = getattr(part, figure), "" if name or figure != "worst" else f"  {part.worst_file}"
        # no zero has a sign
        yield f"{name}{words}", "-" if value is None else f"{round(value, 4) + 0.0:.4f} {unit}{more}"


def _percent(share: float | None, of: int) -> str:
    return "-" if share is None else f"{100 * share:.1f} % ({round(share * of)} of {of})"


def as_csv(found: Comparison) -> str:
    """Return a header and one line."""
    values = _values(found)
    line = [len(value) if isinstance(value, tuple) else value for value in values.values()]
    return csv_table([values, line]).decode("utf-8", "surrogateescape")


def as_json(found: Comparison) -> str:
    """Return one object; the frames without an angle or a known one by name."""
    return json.dumps(_values(found), indent=2) + "\n"


FORMATS = {"table": as_table, "csv": as_csv, "json": as_json}


def _values(found: Comparison) -> dict[str, Any]:
    """Return every figure by its column."""
    values = {
        **_named(found.roll, [field.name for field in fields(Accuracy)], "", "deg"),
        **{name: getattr(found, name) for name in ("ok", "suspect", "no_angle", "no_truth")},
        **_named(found.pitch, _OF_POSE, "pitch_", "deg"),
        **_named(found.height, _OF_POSE, "height_", "m"),
    }
    for distance in DISTANCES_M:
        part, before = found.heights.get(distance), f"over_road_at_{distance}_m_"
        values[f"{before}frames"] = None if part is None else part.count
        values |= _named(part, _LENGTHS, before, "m")
    return {name: round(v, _DIGITS) if isinstance(v, float) else v for name, v in values.items()}


def _named(part: Accuracy | None, names: Iterable[str], before: str, unit: str) -> dict[str, Any]:
    return {
        f"{before}{name}{f'_{unit}' if name in _LENGTHS else ''}": getattr(part, name, None) for name in names
    }


def run_accuracy(options: AccuracyOptions) -> ExitStatus:
    """Compare a result with known angles.

    Parameters
    ----------
    options : AccuracyOptions

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
    result, truth, running = options.result, options.truth, options.running
    writes = [] if is_stream(options.output) else [options.output]
    read, known = read_result(result), read_truth(truth)
    folders = _height_folders(read, options)
    if listed_only(lambda: [([result, truth, *folders], writes)], running):
        return ExitStatus.DONE
    found = replace(assess(read.rows, known, result), heights=_heights(read.rows, known, folders, options))
    running.note(*_not_compared(found, read.rows, known, options))
    data = FORMATS[options.format](found).encode("utf-8", "surrogateescape")
    write_output(options.output, data, overwrite=running.overwrite)
    return ExitStatus.FRAMES_FAILED if found.no_angle else ExitStatus.DONE


def _height_folders(read: Result, options: AccuracyOptions) -> tuple[str, ...]:
    """Return where heights lie, those that were named or that the run wrote; true ones; their disparity."""
    heights, beside = options.heights, os.path.dirname(options.truth) or "."  # noqa: PTH120 (also of a URL)
    if heights is None:
        heights = recorded_options(read.run, run_path(options.result)).images.heights
        if heights is None or not (is_folder(heights) and is_folder(f"{beside}/heights")):
            return ()
    return heights, f"{beside}/heights", f"{beside}/disparity"


def _heights(
    rows: Sequence[Row], known: Mapping[str, KnownPose], folders: Sequence[str], options: AccuracyOptions
) -> dict[int, Accuracy]:
    """Compare the heights over the road in these folders."""
    try:
        found = assess_heights(rows, known, *folders) if folders else {}
    except (InputError, UsageError) as error:
        if options.heights is not None:
            raise
        options.running.note(f"no heights are compared: {error}")  # nobody has asked for them
        return {}
    if found is None:
        options.running.note(
            f"{folders[0]}: no heights are compared: they need metres (estimate --calib), and the truth "
            "columns focal_px and baseline_m"
        )
    return found or {}


def _not_compared(
    found: Comparison, rows: Sequence[Row], known: Mapping[str, KnownPose], options: AccuracyOptions
) -> Iterator[str]:
    """Yield which frames could not be compared, the first few by name; and of how many the pose could not.

    It could not where the road bends away from that below the camera.
    """
    for names, where, what in (
        (found.no_angle, options.truth, f"no angle in {options.result}"),
        (found.no_truth, options.result, f"no known angle in {options.truth}"),
    ):
        if names:
            frames = "1 frame has" if len(names) == 1 else f"{len(names)} frames have"
            yield f"{where}: {frames} {what}: {listed(names)}"
    posed = (known.get(stem_of(row.file)) for row in rows if row.pitch_deg is not None)
    bent = sum(pose is not None and pose.bends for pose in posed)
    if bent:
        frames = "1 frame, whose road bends" if bent == 1 else f"{bent} frames, whose roads bend"
        yield f"{options.truth}: pitch and height are not compared on {frames} (curvature_per_m)"
