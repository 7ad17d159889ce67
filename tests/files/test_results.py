"""Rows to text and back, columns of a result, and which row belongs to which file."""

import io
import itertools
import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from rollcli.errors import InputError, UsageError
from rollcli.files.codecs.parquet import encode_parquet
from rollcli.files.matching import is_elsewhere, match_paths
from rollcli.files.result_columns import read_columns
from rollcli.files.results import (
    ALIGNMENT_COLUMNS,
    COLUMNS,
    FURTHER,
    STATUSES,
    TIMING,
    Row,
    column_types,
    columns,
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
FAILED = Row(file="maps/b.png", status="error", message="maps/b.png: is empty")


def test_a_row_of_csv_has_fixed_digits_and_rfc_4180_quotes():
    assert format_row(ROW, "csv") == (
        b"maps/a.png,,suspect,-1.250000,0.012346,2.500000,0.032346,1.651235,0.004000,-0.012346,"
        b"gd,4,true,false,0.123457,-45.0018767,0.300002217,"
        b'-3.83765039e-09,0.597333,0.500000,1242,375,-0.5124,0.1500,0.3000,0.0000,"one, ""two"""\n'
    )


@pytest.mark.parametrize("text", ["a,b", 'a"b', "a\nb", "a\rb", "\r"])
def test_what_csv_gives_a_meaning_is_quoted(text):
    line = format_row(Row(file=text), "csv")
    assert line.startswith(b'"' + text.replace('"', '""').encode() + b'",')
    assert tuple(parse_rows(format_header("csv") + line, "x")) == (Row(file=text),)


def test_an_error_row_holds_no_numbers():
    assert format_row(FAILED, "csv") == b"maps/b.png,,error" + b"," * 24 + b"maps/b.png: is empty\n"


def test_timing_is_a_column_of_its_own_at_the_end():
    assert columns([TIMING]) == (*COLUMNS, "elapsed_ms")
    assert format_row(Row("a", elapsed_ms=1.23456), "csv", [TIMING]).endswith(b",1.235\n")


@pytest.mark.parametrize("form", ["csv", "jsonl"])
@pytest.mark.parametrize("row", [ROW, FAILED, Row("new\nline,\udcff.png", message="a"), Row("=ü/雨.png")])
def test_what_is_written_is_read_back(form, row):
    data = format_header(form) + format_row(row, form)
    (back,) = parse_rows(data, "rolls")
    assert (back.file, back.status, back.message, back.converged) == (
        row.file,
        row.status,
        row.message,
        row.converged,
    )
    assert format_row(back, form) == format_row(row, form)


@pytest.mark.parametrize(
    ("theta_deg", "text"),
    [(-1e-9, "0.000000"), (0.0, "0.000000"), (-89.9999999, "90.000000"), (90.0, "90.000000")],
)
def test_rounding_makes_no_negative_zero_and_stays_within_the_half_open_range(theta_deg, text):
    assert format_row(Row("a", roll_deg=theta_deg), "csv").split(b",")[3].decode() == text


def test_numbers_that_are_not_finite_are_left_empty():
    assert format_row(Row("a", rmse_px=math.nan, alpha0=math.inf), "csv") == b"a,,error" + b"," * 24 + b"\n"


def test_a_result_is_read_with_the_record_of_its_run(tmp_path):
    path = tmp_path / "rolls.csv"
    path.write_bytes(format_header("csv") + format_row(ROW, "csv"))
    assert read_result(path).run is None
    (tmp_path / "rolls.csv.run.json").write_text('{"rollcli": "1"}')
    result = read_result(path)
    assert result.run == {"rollcli": "1"}
    assert result.rows[0].roll_deg == -1.25


def test_further_columns_and_a_byte_order_mark_do_no_harm(tmp_path):
    path = tmp_path / "edited.csv"
    path.write_bytes(b"\xef\xbb\xbfroll_deg,note,file,status\r\n1.5,mine,a.png,ok\r\n\r\n")
    (row,) = read_result(path).rows
    assert (row.file, row.roll_deg, row.method, row.width) == ("a.png", 1.5, "", None)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "no column file, status, roll_deg"),
        (b"frame,roll\n1,2\n", "not a result of rollcli estimate: it has no column file"),
        (b"file,status,roll_deg\na,ok,much\n", "line 2: 'much' is no value for roll_deg"),
        (b"file,status,roll_deg\na,ok\n", "line 2: 2 values for 3 columns"),
        (b'file,status,roll_deg\n"a,ok,1\n', "is not CSV"),
        (b"\x89PNG\r\n\x1a\n\x00", "not a result"),
        (b'{"a": 1}\n', "line 1: is no row of rollcli estimate: no file"),
        (b'{"a": \n', "line 1: is not JSON"),
    ],
)
def test_what_is_no_result_is_refused_with_its_line(tmp_path, data, reason):
    path = tmp_path / "rolls"
    path.write_bytes(data)
    with pytest.raises(InputError, match=reason) as caught:
        read_result(path)
    assert str(caught.value).startswith(str(path))


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


def test_every_number_has_its_digits_in_every_form():
    numbers = {name: 1.23456789012 for name, kind in column_types(FURTHER).items() if kind is float}
    digits = {"rmse_px": "1.23457", **dict.fromkeys(("alpha0", "alpha1", "alpha2"), "1.23456789")}
    texts = {name: digits.get(name, "1.234568") for name in numbers} | {"elapsed_ms": "1.235"}
    texts |= dict.fromkeys(ALIGNMENT_COLUMNS, "1.2346")

    line = format_row(Row("a", **numbers), "csv", FURTHER).decode().rstrip("\n").split(",")
    values = json.loads(format_row(Row("a", **numbers), "jsonl", FURTHER))

    assert {name: line[columns(FURTHER).index(name)] for name in numbers} == texts
    assert {name: values[name] for name in numbers} == {name: float(text) for name, text in texts.items()}


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("converged", "true", True),
        ("converged", "False", False),
        ("global_minimum", "FALSE", False),
        ("iterations", "12", 12),
        ("width", "1242", 1242),
        ("roll_deg", "-90", -90.0),
        ("roll_deg", "90", 90.0),
        ("roll_ci95_deg", "0", 0.0),
        ("pitch_deg", "-90", -90.0),
        ("height_m", "0", 0.0),
        ("rmse_px", "-1e300", -1e300),
        ("method", "gd", "gd"),
    ],
)
def test_a_cell_is_read_as_its_column_has_it(name, text, value):
    values = {"file": "a", "status": "ok", "roll_deg": "1", name: text}
    data = f"{','.join(values)}\n{','.join(values.values())}\n".encode()
    (row,) = parse_rows(data, "x")
    assert getattr(row, name) == value
    assert type(getattr(row, name)) is type(value)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("converged", "yes"),
        ("global_minimum", "1"),
        ("iterations", "1.5"),
        ("width", "wide"),
        ("roll_deg", "-90.1"),
        ("roll_deg", "90.1"),
        ("roll_deg", "nan"),
        ("roll_ci95_deg", "-0.1"),
        ("pitch_deg", "inf"),
        ("height_m", "-1"),
        ("alpha0", "nan"),
        ("alpha0", "-inf"),
    ],
)
def test_a_cell_that_its_column_cannot_have_is_refused(name, text):
    values = {"file": "a", "status": "ok", "roll_deg": "1", name: text}
    data = f"{','.join(values)}\n{','.join(values.values())}\n".encode()
    with pytest.raises(InputError, match=rf"^x: line 2: '{text}' is no value for {name}$"):
        list(parse_rows(data, "x"))


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf", b" \n\n", b" " * 999, b"\xef\xbb\xbf  "])
def test_white_space_may_stand_before_the_first_line_of_json(before):
    line = b'{"file": "a", "status": "ok", "roll_deg": 1}\n'
    (row,) = parse_rows(before + line, "x")
    assert (row.file, row.roll_deg) == ("a", 1.0)


def test_lines_are_numbered_in_every_form():
    good, bad = (
        '{"file": "a", "status": "ok", "roll_deg": 1}',
        '{"file": "a", "status": "bad", "roll_deg": 1}',
    )
    with pytest.raises(InputError, match=r"^x: line 4: 'bad' is no status: ok, suspect, error$"):
        list(parse_rows(f"{good}\n\n{good}\n{bad}\n".encode(), "x"))
    with pytest.raises(InputError, match=r"^x: line 5: 'bad' is no status"):  # the quoted one takes two lines
        list(parse_rows(b'file,status,roll_deg\n"a\nb",ok,1\na,ok,1\na,bad,1\n', "x"))


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


@pytest.mark.parametrize(
    ("names", "rows", "expected"),
    [
        (["a.png", "b.png"], ["b.tif", "a.tif"], [1, 0]),
        (["../maps/a.png"], ["/data/maps/a.png"], [0]),
        (["maps/a.png", "maps/c.png"], ["left/a.png"], [0, None]),
        (["out/x/0.png", "out/y/0.png"], ["left/y/0.png", "left/x/0.png"], [1, 0]),
        (["a.b.png"], ["a.png", "a.b.png"], [1]),
        ([".hidden", "img.0001"], ["img.0001.png", ".hidden"], [1, 0]),
        ([], ["a.png"], []),
    ],
)
def test_the_same_stem_is_a_match_and_folders_decide_between_several(names, rows, expected):
    assert match_paths(names, rows, "rolls.csv") == expected


def test_rows_that_fit_equally_well_are_named():
    with pytest.raises(UsageError, match=r"rolls.csv: more than one row fits maps/0.png: a/0.png, b/0.png"):
        match_paths(["maps/0.png"], ["a/0.png", "b/0.png", "c/1.png"], "rolls.csv")


def test_one_row_for_two_files_is_refused():
    with pytest.raises(UsageError, match=r"the row of left/0.png fits a/0.png and b/0.png"):
        match_paths(["a/0.png", "b/0.png"], ["left/0.png"], "rolls.csv")


@pytest.mark.parametrize(
    ("name", "row", "of_pair", "elsewhere"),
    [
        ("b/0.png", "a/0.png", False, True),
        ("day2/maps/0.png", "day1/maps/0.png", False, True),
        ("/data/day2/maps/0.png", "/data/day1/maps/0.png", False, True),
        ("day2/maps/0.png", "day1/left/0.png", True, True),
        ("maps/0.png", "left/0.png", True, False),
        ("floats/0.tif", "maps/0.png", False, False),
        ("day2/floats/0.tif", "day1/maps/0.png", False, True),
        ("day1/maps/0.png", "day1/left/0.png", True, False),
        ("out/x/0.png", "left/x/0.png", True, False),
        ("out/maps/0.png", "day1/out/maps/0.png", False, False),
        ("0.png", "day1/maps/0.png", False, False),
        ("../maps/0.png", "maps/0.png", False, False),
        ("./maps/0.png", "maps/0.tif", False, False),
        ("/mnt/run7/maps/0.png", "/data/run7/maps/0.png", False, False),
        ("run7/maps/0.png", "/data/drives/run7/maps/0.png", False, False),
        ("s3://mine/run7/0.png", "run7/0.png", False, False),
        ("s3://mine/run8/0.png", "s3://mine/run7/0.png", False, True),
    ],
)
def test_a_row_of_another_drive_is_told_by_the_folders_that_differ(name, row, of_pair, elsewhere):
    assert is_elsewhere(name, row, of_pair=of_pair) is elsewhere
