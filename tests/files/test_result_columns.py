"""Columns of a result are those of its rows, and a number that no row can have is named."""

import io
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
    plain_values,
    read_result,
)

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


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_columns_of_text_are_those_of_the_rows(tmp_path, form, before):
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


def test_columns_of_parquet_are_those_of_the_rows(tmp_path):
    (tmp_path / "rolls").write_bytes(bytes_of("parquet"))
    check(read_columns(str(tmp_path / "rolls"), ["roll_deg", "pitch_deg"]))


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
        ("a\0b,ok,1", r"line 3: 'a\\x00b' is no value for file"),
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
