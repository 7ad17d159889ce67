"""`rollcli derotate`: maps rotated by one angle, or each by the angle that a result has for it."""

import math
from collections.abc import Iterator, Sequence
from functools import partial

from rollcli.convert.options import DerotateOptions, TurnOptions
from rollcli.convert.run import Conversion, convert
from rollcli.errors import UsageError
from rollcli.files.matching import match_paths
from rollcli.files.naming import listed
from rollcli.files.results import Row, read_result
from rollcli.frames.find import map_frames
from rollcli.frames.frame import Frame, Outcome
from rollcli.frames.options import EncodingOptions
from rollcli.frames.outputs import output_path


def derotate_maps(options: DerotateOptions) -> int:
    """Rotate every map; the exit status."""
    turn = options.turn
    if (turn.roll_deg is None) == (turn.result is None):
        raise UsageError("give either --roll, one angle for all maps, or --from, a result with one for each")
    frames = map_frames(options.inputs, skip=[options.output])
    conversions = list(_conversions(frames, turn, options.output))
    do = partial(_derotate, encoding=options.encoding, expand=turn.expand)
    return convert(conversions, do, options.running, options.encoding)


def _conversions(frames: Sequence[Frame], turn: TurnOptions, folder: str) -> Iterator[Conversion]:
    rows = _rows_of(frames, turn.result) if turn.result is not None else [None] * len(frames)
    for frame, row in zip(frames, rows, strict=True):
        roll_deg = turn.roll_deg if row is None else row.roll_deg
        refused = "" if roll_deg is not None else f"has no angle in {turn.result}"
        writes = (output_path(frame, folder),)
        yield Conversion(frame, writes, math.radians(roll_deg or 0.0), refused)


def _rows_of(frames: Sequence[Frame], result: str) -> list[Row]:
    """The row of each frame.

    Raises
    ------
    UsageError
        Names maps without a row, rows that have an angle but no map, and what fits more than one.
    """
    rows = read_result(result).rows
    found = match_paths([frame.file for frame in frames], [row.file for row in rows], result)
    alone = [frame.file for frame, at in zip(frames, found, strict=True) if at is None]
    if alone:
        raise UsageError(f"{result}: has no row for {listed(alone)}")
    used = [at for at in found if at is not None]
    lost = [rows[at] for at in sorted(set(range(len(rows))).difference(used))]
    if any(row.roll_deg is not None for row in lost):
        names = listed(row.file for row in lost if row.roll_deg is not None)
        raise UsageError(f"{result}: no map is given for its rows of {names}")
    return [rows[at] for at in used]


def _derotate(conversion: Conversion, encoding: EncodingOptions, expand: bool) -> Outcome:
    from rollcli.convert.work import derotate_map  # where the work is done

    return derotate_map(conversion, encoding, expand)
