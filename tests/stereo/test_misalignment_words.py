"""What a row says of a misalignment can be read back from it, and a run says what to do."""

import itertools
import math

import numpy as np
import pytest

from rollcli.files.results import Row
from rollcli.run.progress import RigAlignment
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.misalignment_words import NOT_LEVELLED, TOO_LITTLE, advice_of, note_of, read_note

ODD = Misalignment(offset=-0.52, rotation=math.radians(0.31), scale=-0.004, twist=2e-5)
WORDS = (
    "corrected: the right image lay 0.52 px higher, was turned clockwise by 0.310 degrees, "
    "was 0.400 % smaller, had rows skewed by 1.00 px"
)


def test_a_row_says_what_was_corrected():
    assert note_of(ODD, 200, 1000) == WORDS
    assert note_of(Misalignment(offset=2), 200, 1000) == "corrected: the right image lay 2.00 px lower"
    assert note_of(LEVEL, 200, 1000) == ""


@pytest.mark.parametrize("message", [WORDS, f"the interval is wide: 0.81; {WORDS}; lay 3.00 px lower"])
def test_the_numbers_are_read_back(message):
    found = read_note(message, 200, 1000)

    assert (found.offset, found.scale) == (-0.52, -0.004)
    assert found.rotation_deg == pytest.approx(0.31)
    assert found.twist == pytest.approx(2e-5)


@pytest.mark.parametrize("message", ["", "the right image lay 1.00 px lower", "corrected"])
def test_a_row_that_says_nothing_is_level(message):
    assert read_note(message, 200, 1000) == LEVEL


def row(message, status="ok", right="r.png", width=1000):
    return Row("l.png", right, status, width=width, height=200, message=message)


def test_a_run_says_the_median_over_its_pairs_and_what_to_do():
    rig = RigAlignment()
    for turned in (0.3, 0.31, 0.5):
        rig.add(row(note_of(Misalignment(rotation=math.radians(turned)), 200, 1000)))

    assert rig.summary()["right_camera_roll_deg"] == 0.31
    assert rig.summary()["frames"] == 3
    assert rig.advice == (
        "the right camera is rolled by 0.31 degrees against the left, counter-clockwise seen from behind: "
        "recalibrate"
    )


def test_a_run_of_mostly_level_pairs_asks_for_nothing():
    rig = RigAlignment()
    for message in ("", "", "corrected: the right image lay 1.00 px lower"):
        rig.add(row(message))

    assert rig.advice == ""
    assert rig.summary()["corrected"] == 1
    assert rig.summary()["right_lower_px"] == 0


def test_a_run_of_maps_or_of_level_pairs_has_nothing_to_say():
    rig = RigAlignment()
    rig.add(row("", right=""))
    rig.add(row(""))
    rig.add(Row("l.png", "r.png", "error", message="l.png: cannot be read"))

    assert rig.summary() is None
    assert rig.advice == ""


@pytest.mark.parametrize("doubt", [NOT_LEVELLED, TOO_LITTLE])
def test_what_was_tried_in_vain_is_no_advice(doubt):
    rig = RigAlignment()
    rig.add(row(f"{doubt}; corrected: the right image was 7.573 % smaller", status="suspect"))

    assert rig.summary() is None
    assert rig.advice == ""


def test_every_part_has_its_advice():
    odd = Misalignment(0.6, math.radians(-0.2), 0.003, 3e-5)

    assert advice_of(odd, 200, 1000).split(", ") == [
        "the right camera is rolled by 0.20 degrees against the left",
        "clockwise seen from behind",
        "the right image lies 0.60 px lower",
        "the right image is 0.30 % larger",
        "its rows are skewed by 1.5 px in the corners: recalibrate",
    ]


@pytest.mark.parametrize("signs", list(itertools.product((-1, 1), repeat=4)))
def test_the_reach_is_the_largest_shift_of_the_four_corners(signs):
    offset, rotation, scale, twist = (
        sign * size for sign, size in zip(signs, (0.7, 2e-3, 5e-3, 4e-5), strict=True)
    )
    corners = itertools.product((-320, 320), (-100, 100))  # of a view of 640 x 200 pixels
    shifts = [offset + rotation * x + scale * y + twist * x * y for x, y in corners]
    assert Misalignment(offset, rotation, scale, twist).reach(200, 640) == pytest.approx(
        max(map(abs, shifts))
    )


@pytest.mark.parametrize("signs", list(itertools.product((-1, 1), repeat=4)))
@pytest.mark.parametrize("rows", [(0, 200), (0, 60), (120, 200)])
def test_the_reach_in_rows_is_the_largest_shift_in_their_middle_half(rows, signs):
    offset, rotation, scale, twist = (
        sign * size for sign, size in zip(signs, (0.7, 2e-3, 5e-3, 4e-5), strict=True)
    )
    x, y = np.meshgrid(np.arange(-160, 161), np.arange(rows[0], rows[1] + 1) - 100)
    shifts = offset + rotation * x + scale * y + twist * x * y
    found = Misalignment(offset, rotation, scale, twist).reach_in_rows(200, 640, *rows)
    assert found == pytest.approx(np.abs(shifts).max())
