"""What --dry-run says, on stdout."""

from collections.abc import Iterable

from rollcli.files.stream import write_stdout


def list_files(frames: Iterable[tuple[Iterable[str], Iterable[str]]]) -> None:
    """Say what would be read and written, a line each; `frames` holds (reads, writes)."""
    lines: list[str] = []
    for reads, writes in frames:
        lines += [f"read  {path}\n" for path in reads]
        lines += [f"write {path}\n" for path in writes]
    write_stdout("".join(lines).encode("utf-8", "surrogateescape"))
