"""What the pairs of a drive say together of the columns of their right views, for a correction."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rollcli.files.results import parse_rows, pieces_of, read_run, run_path
from rollcli.files.stores.locations import is_remote
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.quantities import ALIGNMENT
from rollcli.run.frame import Frame
from rollcli.run.frame_errors import FRAME_ERRORS
from rollcli.run.options import FrameOptions
from rollcli.run.read import read_views, wanted_of
from rollcli.run.record import recorded_options
from rollcli.run.result_rows import frame_of_row
from rollcli.stereo.match import match_pair
from rollcli.stereo.misalignment import ColumnSupport
from rollcli.stereo.row_fit import ColumnEvidence, column_support

_PAIRS = 24  # matched again, a few seconds: 8 of rendered roads tell a scale to 0.02 %, one to 0.1
_FEWEST = 4


def columns_of_drive(rig: RigAssessment, results: Sequence[str]) -> ColumnSupport | None:
    """Match some pairs of the last drive again, and put together what their rows say of the columns.

    One pair of an empty road cannot tell a right view that is larger from rows that are bent; the pairs of a
    drive can, for its rig is one.

    Returns
    -------
    ColumnSupport or None
        Pixels of the size matched at; None where too few of the pairs can be read here.
    """
    found: list[ColumnEvidence] = []
    for frame, options in _pairs(rig, results):
        try:
            left, right = read_views(frame, options)
            measured = match_pair(left, right, options.stereo, wanted_of(None, options)).measured
        except FRAME_ERRORS:  # the pairs that are left may be enough
            continue
        if measured is not None and measured.evidence is not None:
            found.append(measured.evidence)
    same = [each for each in found if (each.shape, each.factor) == (found[-1].shape, found[-1].factor)]
    return column_support(ColumnEvidence.of_drive(same)) if len(same) >= _FEWEST else None


def _pairs(rig: RigAssessment, results: Sequence[str]) -> Iterator[tuple[Frame, FrameOptions]]:
    """Yield pairs of the last drive whose views were measured, evenly spread, and how they were matched."""
    drive = rig.latest_drive(ALIGNMENT[0])
    if drive is None:
        return
    told = drive.frames[np.isfinite(rig.frames.numbers[ALIGNMENT[0].column][drive.frames])]
    chosen = told[np.linspace(0, len(told) - 1, min(_PAIRS, len(told))).astype(np.intp)]
    names = {rig.frames.files[place] for place in chosen}
    for result in results:
        options = _matched_as(read_run(result), result)
        for name, data in pieces_of(result):
            for row in parse_rows(data, name):
                if row.file in names and row.right_file and not is_remote(row.file):
                    yield frame_of_row(row, result), options


def _matched_as(run: Mapping[str, object] | None, result: str) -> FrameOptions:
    options = recorded_options(run, run_path(result))
    return options._replace(stereo=replace(options.stereo, align="auto", vertical_offset=None))
