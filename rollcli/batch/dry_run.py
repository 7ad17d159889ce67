"""What --dry-run says, on stdout."""

import os
from collections.abc import Iterable


def list_files(frames: Iterable[tuple[Iterable[str], Iterable[str]]]) -> None:
    """Say what would be read and written, a line each; `frames` holds (reads, writes)."""
    lines: list[str] = []
    for reads, writes in frames:
        lines += [f"read  {path}\n" for path in reads]
        lines += [f"write {path}\n" for path in writes]
    data = "".join(lines).encode("utf-8", "surrogateescape")
    while data:
        data = data[os.write(1, data) :]
