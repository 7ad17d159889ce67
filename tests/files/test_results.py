"""Rows to text and back, columns of a result, and which row belongs to which file."""

import itertools
import sys

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.results import (
    STATUSES,
    Row,
    column_types,
    encode_parquet,
    format_header,
    format_row,
    plain_values,
    read_columns,
    read_result,
)
from rollcli.files.storage import write_bytes

LAST = Row("last.png", status="ok", roll_deg=0.0)  # a 0 is no empty cell
HOSTILE = {
    "nested 100,000 deep": b'{"file": ' + b"[" * 100_000,
    "a number of 5,000 digits": b'{"file": "a", "status": "ok", "roll_deg": ' + b"1" * 5000 + b"}",
    "such a number in CSV": b"file,status,roll_deg,iterations\na,ok,1," + b"1" * 5000 + b"\n",
    "a number whose square is none": b"file,status,roll_deg,roll_ci95_deg\na,ok,1,1e300\n",
    "a long status": b"file,status,roll_deg\na," + b"x" * 5000 + b",1\n",
}


def test_a_result_in_a_bucket_is_read_without_the_record_of_its_run(bucket):
    write_bytes(f"{bucket}/rolls.csv", b"file,status,roll_deg\na.png,ok,1\n")
    assert read_result(f"{bucket}/rolls.csv").run is None


@pytest.mark.parametrize("read", [read_result, lambda path: read_columns(path, ["roll_deg"])])
def test_a_result_from_a_closed_stdin_is_refused(monkeypatch, read):
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(InputError, match=r"^-: stdin is closed; nothing can be read from it$"):
        read("-")


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
    path.write_bytes(format_header("csv") + format_row(LAST, "csv"))
    (tmp_path / "rolls.csv.run.json").write_bytes(record)

    with pytest.raises(InputError, match=rf"^[^\n]*run.json: {said}[^\n]*$"):
        read_result(path)


def test_a_name_that_leaves_no_room_for_its_record_has_none(tmp_path):
    path = tmp_path / ("n" * 249 + ".csv")
    path.write_bytes(format_header("csv") + format_row(LAST, "csv"))

    assert read_result(path).run is None


ROWS = [
    Row(f"{place}.png", status=STATUSES[place % 3], roll_deg=place / 8, method=("gd", "", "gss")[place % 3])
    for place in range(700)  # more than are held as text at once
]


def bytes_of(form):
    rows = [*ROWS, LAST]
    if form == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
        return encode_parquet(column_types(), [plain_values(row) for row in rows], {})
    return format_header(form) + b"".join(format_row(row, form) for row in rows)


@pytest.mark.parametrize(
    ("form", "before"), [*itertools.product(("csv", "jsonl"), (b"", b"\xef\xbb\xbf")), ("parquet", b"")]
)
def test_columns_are_those_of_the_rows(tmp_path, form, before):
    (tmp_path / "rolls").write_bytes(before + bytes_of(form))
    (tmp_path / "rolls.run.json").write_text('{"rollcli": "1"}')

    found, rows = read_columns(str(tmp_path / "rolls"), ["roll_deg", "pitch_deg"]), [*ROWS, LAST]
    assert found.files == [row.file for row in rows]
    assert [STATUSES[status] for status in found.status] == [row.status for row in rows]
    assert found.numbers["roll_deg"].tolist() == [float(f"{row.roll_deg:.6f}") for row in rows]
    assert np.isnan(found.numbers["pitch_deg"]).all()
    assert found.methods == {"gd", "gss"}
    assert found.run == {"rollcli": "1"}
