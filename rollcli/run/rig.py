"""`rollcli rig` from the command line: what is read and written, and the exit status."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollcli.errors import InputError, UsageError
from rollcli.files import results
from rollcli.files.locking import given_as
from rollcli.files.naming import natural_key
from rollcli.files.storage import STREAM, is_stream, write_output
from rollcli.files.stores.locations import base_name, is_remote
from rollcli.messages import listed, say
from rollcli.rig.drive.assess import RigAssessment, RigFrames, assess_frames, difference, short_names
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.quantities import ALIGNMENT, COLUMNS, QUANTITIES, ROLL
from rollcli.rig.words import findings
from rollcli.run.find import calibration_files, calibration_finder
from rollcli.run.frame import Frame, frame_of_row
from rollcli.run.options import FramesOptions, RegionOptions, RigOptions
from rollcli.run.outputs import check_named_once, listed_only
from rollcli.run.read import FRAME_ERRORS, read_source
from rollcli.run.resume import recorded_downscale, recorded_encodings, recorded_options
from rollcli.run.rig_gates import check_options, health_of, run_checks, status_of
from rollcli.run.rig_text import FORMATS, NO_COLUMNS, Findings, correction_text, moves
from rollcli.stereo.alignment import Measured
from rollcli.stereo.correction import DriveRows
from rollcli.stereo.row_fit import ColumnEvidence, column_support


def _assessed(paths: Sequence[str], options: RigOptions) -> tuple[RigAssessment, str, list[str]]:
    """Assess the rig of one result, of the shards of one run, or of several results, in any order.

    Returns
    -------
    RigAssessment, str, list of str
        The rig; why frames of the run are not there, empty when all are; and further lines for stderr.

    Raises
    ------
    InputError
        A file is not a result, or has no rows.
    UsageError
        Shards are not of one run, one is missing, or the rows are of several methods.
    """
    parts = [results.read_columns(path, COLUMNS) for path in paths]
    require_rows(parts, "assess")
    methods = sorted(set().union(*(part.methods for part in parts)))
    if len(methods) > 1:
        names = listed(part.path for part in parts)
        raise UsageError(f"{names}: rows of the methods {', '.join(methods)}: assess each method by itself")
    order, origins = order_of(parts)
    joined = [file for part in parts for file in part.files]
    status = np.concatenate([part.status for part in parts])[order]
    frames = RigFrames(
        [joined[place] for place in order] if len(parts) > 1 else joined,
        status == results.STATUSES.index("ok"),
        status == results.STATUSES.index("suspect"),
        {name: _joined(parts, name)[order] for name in COLUMNS if any(name in p.numbers for p in parts)},
        origins,
    )
    rig = assess_frames(frames, include_suspect=options.include_suspect, groups=options.groups)
    return rig, unfinished(parts), _notes(parts)


def _joined(parts: Sequence[results.ResultColumns], name: str) -> NDArray[np.float64]:
    return np.concatenate([part.numbers.get(name, np.full(len(part.files), np.nan)) for part in parts])


Part = results.Result | results.ResultColumns  # one of several that are put together


def require_rows(parts: Sequence[Part], purpose: str) -> None:
    """Refuse results without rows; of several shards some may have none, as of few frames.

    Raises
    ------
    InputError
    """
    some = any(part.files for part in parts)
    for part in parts:
        if not (part.files or (some and _shard(part) not in (None, (1, 1)))):
            raise InputError(f"{part.path}: has no rows: there is nothing to {purpose}")


def order_of(parts: Sequence[Part]) -> tuple[NDArray[np.intp], list[str]]:
    """Put the rows of results in order.

    Returns
    -------
    ndarray of int, list of str
        The places of all rows, one part after the other, in the order of the run; and the name of the result
        of each row, where there are several and each is of a whole run, else nothing.
    """
    shards = [_shard(part) for part in parts]
    if set(shards) <= {None, (1, 1)} and (len(parts) == 1 or (1, 1) in shards):
        names = [base_name(part.path) for part in parts]
        if len(set(names)) < len(names):
            names = short_names([part.path for part in parts])
        origins = [name for name, part in zip(names, parts, strict=True) for _ in part.files]
        return np.arange(len(origins)), origins if len(parts) > 1 else []
    if all(shard is None for shard in shards):
        return _by_name(parts), []
    for part, shard in zip(parts, shards, strict=True):
        if shard is None:
            raise UsageError(
                f"{part.path}: there is no {base_name(results.run_path(part.path))} to say which shard it is"
            )
    known = [shard for shard in shards if shard is not None]
    _check_shards(parts, known)
    apart = 0 if _options(parts[0].run).get("shard-by") == "range" else known[0][1]
    places = [index + apart * np.arange(len(p.files)) for p, (index, _) in zip(parts, known, strict=True)]
    return np.argsort(np.concatenate(places), kind="stable"), []


def _check_shards(parts: Sequence[Part], shards: Sequence[tuple[int, int]]) -> None:
    """One run's shards, each once."""
    first, (_, count) = parts[0], shards[0]
    for part, (_, each) in zip(parts, shards, strict=True):
        if each != count or (count == 1 and len(parts) > 1):
            raise UsageError(
                f"{first.path} and {(part if part is not first else parts[1]).path} are not shards of one "
                "run: name all shards of one run, or results of whole runs"
            )
        made = [_made_with(each.run) for each in (first, part)]
        for name in sorted({*made[0], *made[1]}):
            was, now = (given_as(each.get(name)) for each in made)
            if was != now:
                names = f"{first.path} and {part.path}"
                raise UsageError(f"{names} are not shards of one run: {name} was {was} and {now}")
    indices = [index for index, _ in shards]
    twice = next((index for index in indices if indices.count(index) > 1), None)
    if twice is not None:
        same = [p.path for p, index in zip(parts, indices, strict=True) if index == twice]
        raise UsageError(f"{listed(same)}: are both shard {twice}/{count}")
    gone = [f"{index}/{count}" for index in range(1, count + 1) if index not in indices]
    if gone:
        raise UsageError(
            f"{first.path}: is one of {count} shards; missing: {listed(gone)}: name their results too"
        )


def _made_with(run: Mapping[str, Any] | None) -> dict[str, Any]:
    """Options, shard aside, and the version of a run."""
    options = {f"--{name}": value for name, value in _options(run).items() if name != "shard"}
    return {**options, "the version of rollcli": (run or {}).get("rollcli")}


def _options(run: Mapping[str, Any] | None) -> Mapping[str, Any]:
    options = (run or {}).get("options")
    return options if isinstance(options, Mapping) else {}


def _shard(part: Part) -> tuple[int, int] | None:
    """Which shard a result is, by its record; None where there is no record."""
    if part.run is None:
        return None
    found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", str(_options(part.run).get("shard", "1/1")))
    index, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= index <= count:
        raise InputError(f"{results.run_path(part.path)}: is not the record of a run: its shard is no I/N")
    return index, count


def _by_name(parts: Sequence[Part]) -> NDArray[np.intp]:
    """Without records: the natural order of the names, in which a run's frames are."""
    owner: dict[str, str] = {}
    for path, file in ((part.path, file) for part in parts for file in part.files):
        if (first := owner.setdefault(file, path)) != path:
            both = f"{first} and {path} both have a row of {file}: they are no shards"
            raise UsageError(f"{both}; results of several runs need FILE.run.json beside them")
    keys = [natural_key(file) for part in parts for file in part.files]
    return np.array(sorted(range(len(keys)), key=keys.__getitem__), dtype=np.intp)


def unfinished(parts: Sequence[Part]) -> str:
    """Say which run is not over, or was interrupted; empty where none is known to be."""
    for part in parts:
        inputs = (part.run or {}).get("inputs")
        frames = inputs.get("frames") if isinstance(inputs, Mapping) else None
        if isinstance(frames, int) and frames > len(part.files):
            return f"{part.path}: holds {len(part.files):,} of {frames:,} frames: its run has not ended"
    return ""


def _notes(parts: Sequence[results.ResultColumns]) -> list[str]:
    more = {part.path: len(part.files) - len(set(part.files)) for part in parts}
    notes = [
        f"{path}: has several rows of a frame, {n:,} too many: each counts" for path, n in more.items() if n
    ]
    seen = sorted({name for part in parts for name in recorded_encodings(part.run)})
    if len(seen) > 1:
        paths = listed(part.path for part in parts)
        notes.append(f"{paths}: maps were read as {', '.join(seen)}: are they one rig's?")
    return notes


def run_rig(options: RigOptions) -> int:
    """Assess the rig of a result, and check it.

    Parameters
    ----------
    options : RigOptions

    Returns
    -------
    int
        The exit status: 4 when a check fails, 5 when none fails and one cannot be told.

    Raises
    ------
    UsageError, InputError
        Exit status 2: a file is not what it should be, or shards are missing.
    OutputError
        Exit status 1.
    """
    reads = [*options.results, *filter(None, [options.against])]
    outputs = filter(None, [options.output, options.correction])
    writes = [each for each in outputs if not is_stream(each)]
    for names in (reads, writes):
        check_named_once(names)
    if options.output == options.correction == STREAM:
        raise UsageError("--correction and the answer cannot both go to stdout: name a file for one of them")
    check_options(options.gates)
    rig, missing, notes = _assessed(options.results, options)
    after, changes, rigs = None, dict[str, Estimate](), [rig]
    if options.against is not None:
        after, later, more = _assessed([options.against], options)
        missing, notes = missing or later, [*notes, *more]
        origins = [base_name(options.against)] * after.count  # frames of both may have one name
        rigs.append(replace(after, frames=replace(after.frames, origins=origins)))
        changes = {each.name: difference(rig.now(each), after.now(each), each) for each in QUANTITIES}
    pairs = [] if options.correction is None else list(_pairs(rig, options.results))
    reads += calibration_files(options.calibration) + [path for frame, _ in pairs for path in frame.reads()]
    if listed_only(lambda: [(reads, writes)], options.running):
        return 0
    calibration = calibration_finder(options.calibration)(rig.frames.files[-1])
    last, downscale = options.results[-1], 1.0
    if calibration is not None:
        downscale = recorded_downscale(results.read_run(last), results.run_path(last))
    health = health_of(rig, calibration, downscale)
    if calibration is not None and (health is None or calibration.baseline is None):
        lacks = "no pair was measured" if health is None else "it has no baseline"
        notes.append(f"the calibration tells what misaligned views do to depth; no effect here: {lacks}")
    checks = run_checks(rigs, options.gates, missing, changes.get(ROLL.name))
    if not checks and missing:
        notes.append(missing)
    found = Findings(rig, checks, after, changes, health)
    texts = [(options.output, FORMATS[options.format](found))]
    if options.correction is not None:
        rows = None if health is None else rows_of_drive(pairs, health.axis)
        texts.append((options.correction, correction_text(health, rows, options.results)))
        if rows is None:
            options.running.note(f"{options.correction}: {NO_COLUMNS}")
    for name, text in texts:
        write_output(name, text.encode("utf-8", "surrogateescape"), overwrite=options.running.overwrite)
    options.running.note(*notes)
    if options.format != "table" or not is_stream(options.output):
        options.running.note(*findings(rig), *moves(found))
    said = {False: "FAILED", None: "cannot tell"}
    say(*(f"{said[check.ok]}: {check.message}" for check in checks if not check.ok))
    return status_of(checks)


_PAIRS = 24  # matched again, a few seconds: 8 of rendered roads tell a scale to 0.02 %, one to 0.1
_FEWEST = 4


def rows_of_drive(pairs: Iterable[tuple[Frame, FramesOptions]], axis: Sequence[float]) -> DriveRows | None:
    """Match pairs of a drive again, and put together what their rows say.

    One pair of an empty road cannot tell a right view that is larger from rows that are bent; the pairs of a
    drive can, for its rig is one since its last jump. `axis`: see `column_support`.

    Returns
    -------
    DriveRows or None
        Pixels of the size matched at; None where too few of the pairs can be read here.
    """
    found: list[Measured] = []
    for frame, options in pairs:
        try:
            match = read_source(frame, options).match
        except FRAME_ERRORS:  # the pairs that are left may be enough
            continue
        if match is not None and match.measured is not None:
            found.append(match.measured)
    sizes = [(each.rows.shape, each.rows.factor) for each in found]
    same = [each for each, size in zip(found, sizes, strict=True) if size == sizes[-1]]
    if len(same) < _FEWEST:
        return None
    columns = column_support(ColumnEvidence.of_drive([each.evidence for each in same]), axis)
    return DriveRows(columns, float(np.median([each.misalignment.curve for each in same])))


def _pairs(rig: RigAssessment, paths: Sequence[str]) -> Iterator[tuple[Frame, FramesOptions]]:
    """Yield measured pairs of the rig as it is now, and how they were matched.

    They are spread evenly over the last drive, from the last jump on; with a drift, they are its last ones.
    """
    drive = rig.latest_drive(ALIGNMENT[0])
    if drive is None:
        return
    parts = [drive.quantities[each.name] for each in ALIGNMENT if each.name in drive.quantities]
    since = drive.frames[max(each.segments[-1].first for each in parts if each.segments) :]
    told = since[np.isfinite(rig.frames.column(ALIGNMENT[0].column)[since])]
    if any(each.drifts for each in parts):
        told = told[-_PAIRS:]
    chosen = told[np.linspace(0, len(told) - 1, min(_PAIRS, len(told))).astype(np.intp)]
    # results of several runs may have frames of one name
    runs = list(dict.fromkeys(rig.frames.origins)) or [""] * len(paths)
    origins = rig.frames.origins or [""] * rig.count
    names = {(origins[place], rig.frames.files[place]) for place in chosen}
    for path, run in zip(paths, runs, strict=True):
        options = recorded_options(results.read_run(path), results.run_path(path))
        stereo = replace(options.stereo, align="auto", vertical_offset=None)
        options = replace(options, stereo=stereo, region=RegionOptions())
        with suppress(InputError):  # what came by a pipe is gone
            for name, data in results.pieces_of(path):
                for row in results.parse_rows(data, name):
                    if (run, row.file) in names and row.right_file and not is_remote(row.file):
                        yield frame_of_row(row, path), options
