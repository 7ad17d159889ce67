"""Throw broken files at the readers for a while, and keep what they stumble over.

Every file must be read or refused with one line: no other exception, no crash, no more than two seconds of
processor and a gigabyte, and nothing on the terminal. Texts (results, records of runs, settings,
calibrations, known angles, lists) are read by a command, which must end with a status that its help names;
URLs by what makes names of them, which must lead nowhere else.
"""

import argparse
import hashlib
import itertools
import os
import select
import struct
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from random import Random
from typing import IO

from tests.fuzz.corpus import READERS, corpus
from tests.fuzz.mutations import at_random, every_region, with_repairs
from tests.fuzz.texts import READ_BY, texts

ALL = (*READERS, *READ_BY)
HANG = 2.0  # seconds of processor: other processes do not count
PATIENCE = 60.0  # seconds, for what waits and computes nothing
KEPT = Path("out/fuzz")
_FIRST = "warm up"


class Reader:
    """A child process that reads files, and is replaced when one is its end."""

    def __init__(self) -> None:
        self._printed: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as this)
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._printed,
        )
        self.read(b"", _FIRST, hang=PATIENCE)

    def read(self, data: bytes, name: str, hang: float = HANG) -> str:
        """What became of a file: "read", "refused", or a find."""
        before = self._printed.seek(0, 2)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(struct.pack("<II", len(name), len(data)) + name.encode() + data)
        self._process.stdin.flush()
        used, give_up, ready = self._processor_seconds(), time.monotonic() + PATIENCE, False
        while not ready and self._processor_seconds() < used + hang and time.monotonic() < give_up:
            ready = bool(select.select([self._process.stdout], [], [], 0.2)[0])
        answer = self._process.stdout.readline().decode().strip() if ready else ""
        if not answer:
            answer = f"ended with {self._process.wait()}" if ready else f"no answer within {hang} s"
            self._process.kill()
            self.close()
            if name == _FIRST:  # it would be so for ever
                raise RuntimeError(f"the reader cannot start: it {answer}")
            self._start()
        elif self._printed.seek(0, 2) > before:
            self._printed.seek(before)
            answer = f"printed {self._printed.read().decode(errors='replace').strip()!r}"
        return answer

    def _processor_seconds(self) -> float:
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self) -> None:
        """End the child, which tidies up."""
        self._process.communicate()


def broken_files(seed: int, readers: Iterable[str] = ALL) -> Iterator[tuple[str, bytes]]:
    """(name of the whole file, broken file): each region of each file, then places at random without end."""
    files = corpus(readers) | texts(readers)
    for name, whole in files.items():
        for broken in every_region(whole):
            yield from ((name, each) for each in with_repairs(broken))
    random = Random(seed)
    names = list(files)
    for _ in itertools.count():
        name = random.choice(names)
        yield from ((name, each) for each in with_repairs(at_random(files[name], random)))


def main() -> int:
    """Run for the given time; 1 when something was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60, help="how long (default: 60)")
    parser.add_argument(
        "--seed", type=int, default=int(time.time()), help="for random places (default: the time)"
    )
    parser.add_argument(
        "--reader", action="append", choices=ALL, help="whose files, repeatable (default: every one's)"
    )
    options = parser.parse_args()
    readers = options.reader or list(ALL)
    print(f"{', '.join(readers)}, seed {options.seed}, {options.seconds:g} s", flush=True)
    counts: Counter[str] = Counter()
    finds: dict[str, Path] = {}
    reader = Reader()
    end = time.monotonic() + options.seconds
    for name, data in broken_files(options.seed, readers):
        answer = reader.read(data, name)
        counts[answer if answer in ("read", "refused") else "finds"] += 1
        if answer not in ("read", "refused") and answer not in finds:
            KEPT.mkdir(parents=True, exist_ok=True)
            finds[answer] = KEPT / f"{hashlib.sha256(data).hexdigest()[:12]}-{name.replace('/', '-')}"
            finds[answer].write_bytes(data)
            print(f"{finds[answer]}: {answer}", flush=True)
        if time.monotonic() > end:
            break
    reader.close()
    tally = ", ".join(f"{counts[each]} {each}" for each in ("refused", "read", "finds"))
    print(f"{sum(counts.values())} files: {tally}")
    return 1 if finds else 0


if __name__ == "__main__":
    sys.exit(main())
