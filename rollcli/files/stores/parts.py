"""The parts of a result in a folder or below a prefix: `part-00000.csv` and so on."""

import re
from collections.abc import Iterable, Iterator

from rollcli.files.storage import read_bytes

_PART = re.compile(r"part-(\d{5,})\.(csv|jsonl|parquet)")


def part_names(names: Iterable[str]) -> list[str]:
    """Return those of the names that are parts, in the order of their rows."""
    numbered = sorted((int(match[1]), name) for name in names if (match := _PART.fullmatch(name)))
    return [name for _, name in numbered]


def read_parts(folder: str, names: Iterable[str]) -> Iterator[tuple[str, bytes]]:
    """Yield the location and the bytes of each part; a part of CSV gets the header that only the first has.

    Raises
    ------
    InputError
        A part cannot be read.
    """
    header = b""
    for name in names:
        part = read_bytes(f"{folder}/{name}")
        yield f"{folder}/{name}", header + part
        if name.endswith(".csv") and not header:
            header = part[: part.index(b"\n") + 1]
