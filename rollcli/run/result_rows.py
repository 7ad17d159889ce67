"""The row of a result that each map has, and the frame that each row has."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from rollcli.errors import RollcliError, UsageError
from rollcli.files.atomic import is_there
from rollcli.files.containers import file_of
from rollcli.files.inputs import is_elsewhere, match_paths
from rollcli.files.naming import listed
from rollcli.files.results import Row, read_result, run_path
from rollcli.files.stores.locations import is_remote, is_url
from rollcli.messages import say
from rollcli.run.find import mask_finder
from rollcli.run.frame import Frame
from rollcli.run.options import FrameOptions
from rollcli.run.resume import recorded_options

_COMPARED = 3  # maps in other folders than their rows': the first, the last and one between
_SAME_DEG = 1e-4  # a result holds angles to a millionth of a degree


def rows_of(
    frames: Sequence[Frame], result: str, *, quiet: bool, skip_suspect: bool = False, every_row: bool = True
) -> list[Row]:
    """Find the row of each frame, and say how many angles are suspect, and whether they are used.

    Frames and rows are compared by path as far as they agree. Where folders differ, names do not tell a copy
    from another drive: some of these maps are estimated again, and have to give the angles of their rows.

    Raises
    ------
    UsageError
        Names maps without a row, with `every_row` rows that have an angle but no map, and what matches more
        than one; a row is of another drive; or every angle is suspect, and such are left out.
    """
    read = read_result(result)
    rows = read.rows
    found = match_paths([frame.file for frame in frames], [row.file for row in rows], result)
    alone = [frame.file for frame, at in zip(frames, found, strict=True) if at is None]
    if alone:
        raise UsageError(f"{result}: has no row for {listed(alone)}")
    used = [at for at in found if at is not None]
    lost = [rows[at] for at in sorted(set(range(len(rows))).difference(used))]
    if every_row and any(row.roll_deg is not None for row in lost):
        names = listed(row.file for row in lost if row.roll_deg is not None)
        raise UsageError(f"{result}: no map is given for its rows of {names}")
    matched = [rows[at] for at in used]
    elsewhere = [
        (frame, row)
        for frame, row in zip(frames, matched, strict=True)
        if row.roll_deg is not None and is_elsewhere(frame.file, row.file, of_pair=bool(row.right_file))
    ]
    if elsewhere:
        recorded = recorded_options(read.run, run_path(result))
        mask_of = _masks_of(recorded, result)
        for at in {round(i * (len(elsewhere) - 1) / (_COMPARED - 1)): None for i in range(_COMPARED)}:
            frame, row = elsewhere[at]
            if not _is_copy(replace(frame, mask=mask_of(row.file)), row, recorded):
                differ = f"its row is of {row.file}, and not of {frame.file}"
                raise UsageError(f"{result}: {differ}: give the result of these maps")
    _tell_suspects(matched, result, skip_suspect=skip_suspect, quiet=quiet)
    return matched


def frame_of_row(row: Row, result: str) -> Frame:
    """Return the frame of a row; names are of where `estimate` ran: of this folder, or of the result's."""
    path, right = (_located(name, result) for name in (row.file, row.right_file))
    return Frame(row.file, row.right_file, path, right, relative=row.file, mask=None)


def _masks_of(recorded: FrameOptions, result: str) -> Callable[[str], str | None]:
    """Find the masks of a result's run, without which its maps have other angles."""
    mask = recorded.region.mask
    try:
        return mask_finder(mask and _located(mask, result))
    except UsageError as error:
        raise UsageError(f"{result}: its maps are known by the mask that they had: {error}") from error


def _located(name: str, result: str) -> str:
    if not name or is_remote(name):  # even a look at a share of Windows is a request
        return name
    folder = Path() if is_url(result) else Path(result).parent  # names in a bucket are whole URLs
    beside = str(folder / name)
    return beside if not is_there(file_of(name)) and is_there(file_of(beside)) else name


def _is_copy(frame: Frame, row: Row, options: FrameOptions) -> bool:
    """Tell whether a map gives the angle of a row."""
    from rollcli.estimator.estimate import estimate_roll
    from rollcli.run.read import read_source

    try:
        source = read_source(frame, options)
        found = estimate_roll(source.disparity, options.method.request(), mask=source.allowed)
    except (OSError, RollcliError):
        return False
    # of a pair the row is of the road matched along its plane, the map of all that was matched; with a
    # calibration the row is of the lane below the principal point
    other = row.right_file or row.pitch_deg is not None
    most = max(_SAME_DEG, row.roll_ci95_deg or 0.0) if other else _SAME_DEG
    return abs(math.degrees(found.theta) - (row.map_roll_deg or 0.0)) < most


def _tell_suspects(rows: Sequence[Row], result: str, *, skip_suspect: bool, quiet: bool) -> None:
    suspects = sum(row.status == "suspect" for row in rows)
    if skip_suspect and suspects == len(rows):
        raise UsageError(f"{result}: every angle is suspect: --skip-suspect leaves out all maps")
    if not suspects or quiet:
        return
    done = "; such maps are left out" if skip_suspect else " and used; --skip-suspect leaves such maps out"
    say(f"{result}: {suspects} of {len(rows)} angles {'is' if suspects == 1 else 'are'} suspect{done}")
