"""The process that reads broken files: memory limited, so that nobody else suffers."""

import resource
import struct
import sys
import traceback
from pathlib import Path
from typing import BinaryIO

from rollcli.errors import InputError
from rollcli.files.encodings import to_disparity
from rollcli.files.formats import decode_image, decode_mask, decode_stored
from rollcli.run.workers.pool import prepare_worker
from tests.fuzz.corpus import corpus
from tests.fuzz.texts import read_text, texts

MEMORY = 2**30


def read_all_ways(data: bytes) -> str:
    """ "read" or "refused"; anything but an InputError of one line is let through."""
    read = False
    for decode in (
        lambda: to_disparity(decode_stored(data, "x")),
        lambda: decode_mask(data, "x"),
        lambda: decode_image(data, "x"),
    ):
        try:
            decode()
            read = True
        except InputError as error:
            message = str(error)
            if "\n" in message or len(message) > 400 or not message.startswith("x: "):
                raise ValueError(f"no message of one line: {message!r}") from error
    return "read" if read else "refused"


def read_whole(data: bytes, name: str) -> str:
    """Read what bears the name of a text as one, and anything else as a picture."""
    return read_text(data, name) if "/" in name else read_all_ways(data)


def _limit_memory() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer each file with a line; the lengths of its name and of its bytes stand before them."""
    while sizes := requests.read(8):
        name, data = (requests.read(size) for size in struct.unpack("<II", sizes))
        try:
            answer = read_whole(data, name.decode())
        except Exception:  # noqa: BLE001 (whatever gets here is the find)
            answer = "failed: " + " | ".join(
                traceback.format_exc(limit=-1, chain=False).strip().splitlines()[1:]
            )
        answers.write(answer.encode() + b"\n")
        answers.flush()


if __name__ == "__main__":
    prepare_worker()
    for name, whole in (corpus() | texts()).items():
        read_whole(whole, name)  # what is imported late, and kept, does not count
    _limit_memory()
    _serve(sys.stdin.buffer, sys.stdout.buffer)
