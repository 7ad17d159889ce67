"""Results as Parquet: damage is refused, and so is what was made to fill the memory."""

import io
import sys

import pytest

from rollcli.errors import InputError, UsageError
from rollcli.files.results import Row, column_types, decode_parquet, encode_parquet, plain_values
from tests.fuzz.mutations import every_region
from tests.run_cli import error_of, rollcli

pyarrow = pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
parquet = pytest.importorskip("pyarrow.parquet")

ROWS = [plain_values(Row(f"maps/frame{index}.png", status="ok", roll_deg=index / 7)) for index in range(2500)]


def written(**columns):
    target = io.BytesIO()
    parquet.write_table(pyarrow.table(columns), target, compression="zstd")
    return target.getvalue()


def refusal(data):
    return error_of(InputError, list, decode_parquet(data))


@pytest.mark.slow
def test_values_damaged_anywhere_are_refused_or_read_the_same():
    whole = encode_parquet(column_types(), ROWS[:20], {})
    footer = whole[-8 - int.from_bytes(whole[-8:-4], "little") :]  # has no checksum
    for broken in every_region(whole.removesuffix(footer)):
        try:
            rows = list(decode_parquet(broken + footer))
        except InputError:
            continue
        assert rows == list(enumerate(ROWS[:20], 1))


def test_a_table_with_fewer_rows_than_it_says_is_damaged(monkeypatch):
    data = encode_parquet(column_types(), ROWS, {})
    whole = parquet.ParquetFile.iter_batches
    monkeypatch.setattr(parquet.ParquetFile, "iter_batches", lambda *args: [next(whole(*args))])

    assert refusal(data) == "is damaged: it has 1000 of 2500 rows"


def test_text_that_is_not_utf8_is_refused():
    latin = pyarrow.array([b"caf\xe9.png"]).view(pyarrow.string())

    assert refusal(written(file=latin)).startswith("is damaged: ")


@pytest.mark.parametrize(
    "column",
    [lambda: pyarrow.array(["x" * 20_000] * 5_000), lambda: pyarrow.nulls(500_000, pyarrow.float64())],
    ids=["long texts", "rows of nothing"],
)
def test_few_bytes_that_hold_many_values_are_refused(column):
    data = written(file=column())

    assert len(data) < 1_000_000
    assert refusal(data).endswith(("no result has so many", "hold more values than any result"))


def test_a_text_that_stands_for_many_is_refused():
    repeated = pyarrow.array(["x" * 1000] * 10).dictionary_encode()

    assert refusal(written(file=repeated)) == "its column file is a dictionary; write plain values"


def test_many_equal_rows_take_few_bytes_and_are_read():
    row = plain_values(Row("maps/frame.png", status="ok", roll_deg=1.0))
    data = encode_parquet(column_types(), [row] * 100_000, {})

    assert len(data) * 200 < 100_000 * 200  # less than the share that the bytes of a large file allow
    assert sum(1 for _ in decode_parquet(data)) == 100_000


def test_a_name_that_is_not_utf8_is_refused_with_what_to_do():
    rows = [plain_values(Row("caf\udce9.png", status="ok", roll_deg=1.0))]
    with pytest.raises(
        UsageError, match=r"^caf\\udce9.png: this name is not UTF-8, which Parquet cannot hold; use CSV"
    ):
        encode_parquet(column_types(), rows, {})


@pytest.mark.skipif(sys.platform != "linux", reason="names are UTF-8 elsewhere")
def test_such_a_name_is_refused_before_anything_is_done(tmp_path):
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "caf\udce9.png").write_bytes(b"")
    done = rollcli("estimate", "maps", "-o", "r.parquet", "--derotated", "up", cwd=tmp_path)
    assert "is not UTF-8" in done.refused()
    assert [each.name for each in tmp_path.iterdir()] == ["maps"]
