"""Columns of a result are those of its rows, and a number that no row can have is named."""

import math

import pytest

from rollcli.errors import InputError
from rollcli.files.result_columns import read_columns

HEADER = "file,right_file,status,roll_deg,roll_ci95_deg,pitch_deg,height_m"
NUMBERS = ("roll_deg", "roll_ci95_deg", "pitch_deg", "height_m")
WITHIN = {"roll_deg": "1.5", "roll_ci95_deg": "0.1", "pitch_deg": "-2", "height_m": "1.65"}


def result(folder, *rows):
    path = folder / "rolls.csv"
    lines = [f"{place}.png,,ok,{','.join(row[name] for name in NUMBERS)}" for place, row in enumerate(rows)]
    path.write_text("\n".join([HEADER, *lines, ""]))
    return str(path)


@pytest.mark.parametrize(
    ("name", "bound"),
    [
        ("roll_deg", "-90"),
        ("roll_deg", "90"),
        ("roll_ci95_deg", "0"),
        ("pitch_deg", "-90"),
        ("pitch_deg", "90"),
        ("height_m", "0"),
    ],
)
def test_a_number_is_read_at_its_bound_and_refused_beyond_it(tmp_path, name, bound):
    at = read_columns(result(tmp_path, WITHIN, WITHIN | {name: bound}), NUMBERS)
    assert at.numbers[name].tolist() == [float(WITHIN[name]), float(bound)]
    beyond = f"{float(bound) + math.copysign(0.001, float(bound) or -1)}"
    for rows in (
        (WITHIN, WITHIN | {name: beyond}),
        (WITHIN, WITHIN | {name: beyond}, dict.fromkeys(NUMBERS, "")),
    ):
        with pytest.raises(InputError, match=rf"line 3: '{beyond}' is no value for {name}"):
            read_columns(result(tmp_path, *rows), NUMBERS)


@pytest.mark.parametrize("cell", ["nan", "inf", "-inf", "1.5e", "one"])
def test_what_is_no_finite_number_is_refused(tmp_path, cell):
    with pytest.raises(InputError, match=rf"line 2: '{cell}' is no value for height_m"):
        read_columns(result(tmp_path, WITHIN | {"height_m": cell}), NUMBERS)


def test_empty_cells_are_not_numbers_and_leave_the_others_as_they_are(tmp_path):
    found = read_columns(result(tmp_path, WITHIN, dict.fromkeys(NUMBERS, "")), NUMBERS)
    for name in NUMBERS:
        one, other = found.numbers[name].tolist()
        assert one == float(WITHIN[name])
        assert math.isnan(other)
