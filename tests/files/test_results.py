"""Rows to text and back, columns of a result, and which row belongs to which file."""

import io
import itertools
import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.parquet import encode_parquet
from rollcli.files.result_columns import read_columns
from rollcli.files.results import (
    STATUSES,
    Row,
    column_types,
    format_header,
    format_row,
    parse_rows,
    plain_values,
    read_result,
)

ROW = Row(
    file="maps/a.png",
    status="suspect",
    roll_deg=-1.25,
    roll_ci95_deg=0.0123456789,
    pitch_deg=2.5,
    pitch_ci95_deg=0.0323456789,
    height_m=1.65123456,
    height_ci95_m=0.004,
    camber=-0.0123456789,
    method="gd",
    iterations=4,
    converged=True,
    global_minimum=False,
    rmse_px=0.123456789,
    alpha0=-45.0018767123,
    alpha1=0.300002217,
    alpha2=-3.83765039123e-09,
    valid_fraction=0.597333,
    road_fraction=0.5,
    width=1242,
    height=375,
    right_lower_px=-0.51236,
    right_clockwise_deg=0.15004,
    right_larger_percent=0.3,
    right_twist_px=-0.00001,
    message='one, "two"',
)


def test_a_row_of_csv_has_fixed_digits_and_rfc_4180_quotes():
    assert format_row(ROW, "csv") == (
        b"maps/a.png,,suspect,-1.250000,0.012346,2.500000,0.032346,1.651235,0.004000,-0.012346,"
        b"gd,4,true,false,0.123457,-45.0018767,0.300002217,"
        b'-3.83765039e-09,0.597333,0.500000,1242,375,-0.5124,0.1500,0.3000,0.0000,"one, ""two"""\n'
    )


def test_a_result_is_read_with_the_record_of_its_run(tmp_path):
    path = tmp_path / "rolls.csv"
    path.write_bytes(format_header("csv") + format_row(ROW, "csv"))
    assert read_result(path).run is None
    (tmp_path / "rolls.csv.run.json").write_text('{"rollcli": "1"}')
    result = read_result(path)
    assert result.run == {"rollcli": "1"}
    assert result.rows[0].roll_deg == -1.25


def test_a_missing_result_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_result(tmp_path / "none.csv")


HOSTILE = {
    "nested 100,000 deep": b'{"file": ' + b"[" * 100_000,
    "a number of 5,000 digits": b'{"file": "a", "status": "ok", "roll_deg": ' + b"1" * 5000 + b"}",
    "such a number in CSV": b"file,status,roll_deg,iterations\na,ok,1," + b"1" * 5000 + b"\n",
    "a long status": b"file,status,roll_deg\na," + b"x" * 5000 + b",1\n",
}


@pytest.mark.parametrize("what", HOSTILE)
def test_results_made_to_harm_are_refused_in_one_short_line(tmp_path, what):
    path = tmp_path / "rolls"
    path.write_bytes(HOSTILE[what])

    with pytest.raises(InputError, match=r"rolls: line [12]: ") as caught:
        read_result(path)

    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (b"[" * 100_000, "is not JSON"),
        (b'{"options": {"derotated": "a\\u0000b"}}', "is not JSON"),
        (b"1" * 5000, "is not JSON"),
        (b"[1]", "is not the record of a run$"),
    ],
)
def test_a_record_that_is_none_or_made_to_harm_is_refused_in_one_line(tmp_path, record, said):
    path = tmp_path / "rolls.csv"
    path.write_bytes(format_header("csv") + format_row(ROW, "csv"))
    (tmp_path / "rolls.csv.run.json").write_bytes(record)

    with pytest.raises(InputError, match=rf"^[^\n]*run.json: {said}[^\n]*$"):
        read_result(path)


def test_a_name_that_leaves_no_room_for_its_record_has_none(tmp_path):
    path = tmp_path / ("n" * 249 + ".csv")
    path.write_bytes(format_header("csv") + format_row(ROW, "csv"))

    assert read_result(path).run is None


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf", b" \n\n", b" " * 999, b"\xef\xbb\xbf  "])
def test_white_space_may_stand_before_the_first_line_of_json(before):
    line = b'{"file": "a", "status": "ok", "roll_deg": 1}\n'
    (row,) = parse_rows(before + line, "x")
    assert (row.file, row.roll_deg) == ("a", 1.0)


HEADER = "file,right_file,status,roll_deg,roll_ci95_deg,pitch_deg,height_m"
NUMBERS = ("roll_deg", "roll_ci95_deg", "pitch_deg", "height_m")
WITHIN = {"roll_deg": "1.5", "roll_ci95_deg": "0.1", "pitch_deg": "-2", "height_m": "1.65"}


def result(folder, *rows):
    path = folder / "rolls.csv"
    lines = [f"{place}.png,,ok,{','.join(row[name] for name in NUMBERS)}" for place, row in enumerate(rows)]
    path.write_text("\n".join([HEADER, *lines, ""]))
    return str(path)


def test_empty_cells_are_not_numbers_and_leave_the_others_as_they_are(tmp_path):
    found = read_columns(result(tmp_path, WITHIN, dict.fromkeys(NUMBERS, "")), NUMBERS)
    for name in NUMBERS:
        one, other = found.numbers[name].tolist()
        assert one == float(WITHIN[name])
        assert math.isnan(other)


ROWS = [
    Row(f"{place}.png", status=STATUSES[place % 3], roll_deg=place / 8, method=("gd", "", "gss")[place % 3])
    for place in range(700)  # more than are held as text at once
]
LAST = Row("last.png", status="ok", roll_deg=0.0)  # a 0 is no empty cell


def bytes_of(form):
    rows = [*ROWS, LAST]
    if form == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
        return encode_parquet(column_types(), [plain_values(row) for row in rows], {})
    return format_header(form) + b"".join(format_row(row, form) for row in rows)


def check(found):
    rows = [*ROWS, LAST]
    assert found.files == [row.file for row in rows]
    assert [STATUSES[status] for status in found.status] == [row.status for row in rows]
    assert found.numbers["roll_deg"].tolist() == [float(f"{row.roll_deg:.6f}") for row in rows]
    assert np.isnan(found.numbers["pitch_deg"]).all()
    assert found.methods == {"gd", "gss"}


@pytest.mark.parametrize(
    ("form", "before"),
    [*itertools.product(("csv", "jsonl"), (b"", b"\xef\xbb\xbf")), ("parquet", b"")],
)
def test_columns_are_those_of_the_rows(tmp_path, form, before):
    (tmp_path / "rolls").write_bytes(before + bytes_of(form))
    (tmp_path / "rolls.run.json").write_text('{"rollcli": "1"}')

    found = read_columns(str(tmp_path / "rolls"), ["roll_deg", "pitch_deg"])

    check(found)
    assert found.run == {"rollcli": "1"}


@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_columns_come_from_stdin_too(monkeypatch, tmp_path, form):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "-.run.json").write_text('{"rollcli": "1"}')
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BufferedReader(io.BytesIO(bytes_of(form)))))

    found = read_columns("-", ["roll_deg", "pitch_deg"])

    check(found)
    assert found.run is None


def test_columns_of_parts_follow_each_other(tmp_path):
    lines = bytes_of("csv").splitlines(keepends=True)
    (tmp_path / "part-00000.csv").write_bytes(b"".join(lines[:401]))
    (tmp_path / "part-00001.csv").write_bytes(b"".join(lines[401:]))
    check(read_columns(str(tmp_path), ["roll_deg", "pitch_deg"]))


def test_a_column_that_the_file_does_not_have_is_not_there(tmp_path):
    (tmp_path / "rolls").write_text("file,status,roll_deg\na,ok,1\n")
    assert set(read_columns(str(tmp_path / "rolls"), NUMBERS).numbers) == {"roll_deg"}


def test_a_result_without_rows_has_no_values(tmp_path):
    (tmp_path / "rolls").write_text("file,status,roll_deg\n")
    found = read_columns(str(tmp_path / "rolls"), NUMBERS)
    assert (found.files, found.status.tolist(), found.status.dtype) == ([], [], np.uint8)
    assert found.numbers == {}


def test_a_number_of_json_is_read_as_csv_has_it_and_a_wrong_one_is_named_with_its_line(tmp_path):
    good = {"file": "a", "status": "ok", "roll_deg": 1.5, "height_m": None}
    path = tmp_path / "rolls"
    path.write_text("\n".join(json.dumps(good | {"roll_deg": roll}) for roll in (0, 1.5, 0.0)) + "\n")
    assert read_columns(str(path), ["roll_deg"]).numbers["roll_deg"].tolist() == [0, 1.5, 0]

    for wrong, said in (
        ({"roll_deg": "x"}, "'x' is no value for roll_deg"),
        ({"status": 5}, "5 is no status"),
    ):
        path.write_text("\n".join([json.dumps(good), "", json.dumps(good), json.dumps(good | wrong), ""]))
        with pytest.raises(InputError, match=rf"rolls: line 4: {said}"):
            read_columns(str(path), NUMBERS)


def test_carriage_returns_end_no_line_of_json(tmp_path):
    path = tmp_path / "rolls"
    good = b'{"file": "a",\r "status": "ok", "roll_deg": 1}\r\n'
    path.write_bytes(3 * good + good.replace(b"1}", b"x}"))
    with pytest.raises(InputError, match=r"rolls: line 4: is not JSON"):
        read_columns(str(path), ["roll_deg"])
    path.write_bytes(3 * good)
    assert read_columns(str(path), ["roll_deg"]).numbers["roll_deg"].tolist() == [1, 1, 1]
    assert len(read_result(path).rows) == 3
    path.write_bytes(2 * good + good.rstrip(b"\r\n"))
    assert read_columns(str(path), ["roll_deg"]).numbers["roll_deg"].tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (",ok,1", "line 3: '' is no value for file"),
        ("a\0b,ok,1", r"line 3: ('a\\x00b' is no value for file|is not CSV: line contains NUL)"),
        ('{"file": null, "status": "ok", "roll_deg": 1}', "line 2: '' is no value for file"),
        ('{"file": "", "status": "ok", "roll_deg": 1}', "line 2: '' is no value for file"),
    ],
)
def test_a_row_names_a_file(tmp_path, line, said):
    path = tmp_path / "rolls"
    good = (
        '{"file": "a", "status": "ok", "roll_deg": 1}' if line[0] == "{" else "file,status,roll_deg\na,ok,1"
    )
    path.write_text(f"{good}\n{line}\n")
    for read in (lambda: read_columns(str(path), ["roll_deg"]), lambda: read_result(path)):
        with pytest.raises(InputError, match=rf"rolls: {said}$"):
            read()
