"""Tables as Parquet (extra `parquet`): typed columns, nulls, and a record in the schema's metadata."""

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rollcli.errors import InputError, UsageError
from rollcli.extras import require_extra

MAGIC = b"PAR1"
_ROWS_AT_ONCE = 1000
_ROW_BYTES = 200  # of memory that a row takes, even an empty one
# real results have up to 100 bytes of values for each of the file's, and most files are small
_MOST_BYTES, _MOST_FOLD = 64 << 20, 200
_RECORD = b"rollcli"
_ARROW_TYPES = {str: "string", float: "float64", int: "int64", bool: "bool"}


def require_parquet() -> None:
    """Refuse, before any work, what cannot be done without pyarrow.

    Raises
    ------
    UsageError
        The extra `parquet` is not installed.
    """
    require_extra("parquet", "Parquet")


def encode_parquet(
    types: Mapping[str, type], rows: Sequence[Mapping[str, Any]], record: Mapping[str, Any]
) -> bytes:
    """Encode a table.

    Parameters
    ----------
    types : mapping of str to type
        The columns in their order: str, float, int or bool. Any of them may hold None.
    rows : sequence of mapping
        The values by the names of their columns.
    record : mapping
        It stands as JSON under the key `rollcli` of the schema's metadata.

    Raises
    ------
    UsageError
        A text is not UTF-8, as a file name need not be; Parquet cannot hold it.
    """
    import pyarrow
    import pyarrow.parquet

    columns = [(name, _ARROW_TYPES[kind]) for name, kind in types.items()]
    schema = pyarrow.schema(columns, metadata={_RECORD: json.dumps(record).encode()})
    try:
        table = pyarrow.Table.from_pylist(list(rows), schema=schema)
    except UnicodeEncodeError as error:
        name = error.object.encode("utf-8", "backslashreplace").decode()
        raise UsageError(f"{name}: this name is not UTF-8, which Parquet cannot hold; use CSV") from error
    target = io.BytesIO()
    pyarrow.parquet.write_table(table, target, compression="zstd", version="2.6", write_page_checksum=True)
    return target.getvalue()


def decode_parquet(data: bytes, name: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the number (from 1) and the values of each row.

    Raises
    ------
    InputError
        It is damaged, or made to fill the memory.
    UsageError
        The extra `parquet` is not installed.
    """
    require_parquet()
    import pyarrow
    import pyarrow.parquet

    number, allowed = 0, max(_MOST_BYTES, _MOST_FOLD * len(data))
    try:
        file = pyarrow.parquet.ParquetFile(io.BytesIO(data), page_checksum_verification=True)
        claimed = sum(file.metadata.row_group(group).total_byte_size for group in range(file.num_row_groups))
        if claimed > allowed:
            raise InputError(
                f"{name}: claims {claimed} bytes of values in {len(data)}; no result has so many"
            )
        for column in file.schema_arrow:
            if pyarrow.types.is_dictionary(column.type):  # a few bytes of it can stand for gigabytes
                raise InputError(f"{name}: its column {column.name} is a dictionary; write plain values")
        for batch in file.iter_batches(_ROWS_AT_ONCE):
            allowed -= max(batch.nbytes, _ROW_BYTES * batch.num_rows)
            if allowed < 0:
                raise InputError(f"{name}: its {len(data)} bytes hold more values than any result")
            for values in batch.to_pylist():
                number += 1
                yield number, values
        if number != file.metadata.num_rows:
            raise InputError(f"{name}: is damaged: it has {number} of {file.metadata.num_rows} rows")
    except (pyarrow.ArrowException, OSError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: is damaged: {' '.join(str(error).split())[:200]}") from error
