"""Read what a user named, up to a size: files, pipes and standard input. Import-light."""

import codecs
import contextlib
import os
import stat
from pathlib import Path
from typing import BinaryIO

from rollcli.errors import InputError, reading
from rollcli.files.atomic import look_at

# The largest map or picture that is decoded takes 512 MB (codecs/arrays); a result of a million rows 200 MB
MOST_BYTES = 2**30
MOST_LISTED = 2**28  # of a list of files: two million paths
MOST_SETTINGS = 2**20  # of a TOML file, or a correction
MOST_SMALL = 2**25  # bytes that a small compressed file may stand for: an empty map compresses well
MOST_EXPANSION = 48  # bytes that each byte of a larger file may stand for; real maps reach 20
_PIECE = 2**24  # bytes of a file that does not say its size
_OF_DEVICES = 2**20  # /dev/null has an end, /dev/zero has none


def too_large(name: str, size: int | None, most: int, within: str = "") -> InputError:
    """Make the error of a file of more bytes than are read.

    `size` is None where its end was not seen; `within` names the limit of time, where there is one.
    """
    has = f"more than {most}" if size is None else str(size)
    return InputError(f"{name}: has {has} bytes; up to {in_words(most)} are read{within}")


def state_of(path: str) -> tuple[str, int, int, int]:
    """Return path, size, time of change (ns) and process: what tells whether a file that is open is still it.

    A fork shares the place that its parent's files are read at, and needs its own.

    Raises
    ------
    InputError
        It cannot be read.
    """
    with reading(path):
        found = look_at(path)
    return path, found.st_size, found.st_mtime_ns, os.getpid()


def read_given(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Return the bytes of a file, pipe or device that a user named.

    Raises
    ------
    InputError
        It has more bytes than `most`.
    OSError
        It cannot be read.
    """
    with Path(path).open("rb") as file:
        return read_stream(file, str(path), most)


def read_stream(file: BinaryIO, name: str, most: int = MOST_BYTES) -> bytes:
    """Return the bytes of an open file, which errors call `name`; see `read_given`.

    Not by one read of `most`: Python sets aside a gigabyte of addresses before it, which a limit may forbid.
    """
    size = 0
    with contextlib.suppress(OSError, ValueError):  # no file of the system's
        status = os.fstat(file.fileno())
        if stat.S_ISREG(status.st_mode):
            size = status.st_size
        elif stat.S_ISCHR(status.st_mode) and not os.isatty(file.fileno()):
            most = min(most, _OF_DEVICES)
    if size > most:
        raise too_large(name, size, most)
    pieces, left, wanted = list[bytes](), most + 1, size + 1
    while left:
        pieces.append(file.read(wanted))
        if len(pieces[-1]) < wanted:
            return b"".join(pieces)
        left -= wanted
        wanted = min(_PIECE, left)
    raise too_large(name, None, most)  # it has grown, or does not say its size


def most_unpacked(packed: int) -> int:
    """Return how many bytes so many compressed ones may become."""
    return min(MOST_BYTES, max(MOST_SMALL, MOST_EXPANSION * packed))


def as_utf8(data: bytes, name: str) -> bytes:
    """Return text as UTF-8 without a mark at its start; Windows writes such marks, and UTF-16 behind one.

    Raises
    ------
    InputError
        It is damaged UTF-16, or UTF-32.
    """
    if data.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        raise InputError(f"{name}: is UTF-32; save it as UTF-8")
    if not data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode("utf-16").encode()
    except UnicodeError as error:
        raise InputError(f"{name}: is damaged UTF-16; save it as UTF-8") from error


def in_words(size: int) -> str:
    """Say how many bytes a limit is."""
    return f"{size >> 30} GB" if size >= 2**30 else f"{size >> 20} MB" if size >= 2**20 else f"{size} bytes"
