"""A file that lists sorted names, which are read when they are asked for: there may be a hundred million."""

import os
from array import array
from collections.abc import Iterator
from pathlib import Path

from rollcli.errors import UsageError
from rollcli.files.naming import natural_key

_BLOCK = 4096  # lines between two places that are known: 100,000,000 lines have 200 kB of places


class Manifest:
    """The names of a file, one a line.

    Parameters
    ----------
    path : str

    Raises
    ------
    UsageError
        It cannot be read, holds no name, or its names are not in natural order, each once.
    """

    def __init__(self, path: str) -> None:
        self._path, self._places, self._count = path, array("Q"), 0
        before, key_before = "", ""
        for number, name in self._lines(0, self._places):
            key = natural_key(name)
            if self._count and key <= key_before:
                how = "is there twice" if name == before else f"sorts before {before}"
                raise UsageError(
                    f"{path}: line {number}: {name} {how}; --sorted takes names in natural order "
                    "(frame2 before frame10), each once: leave it out, and they are sorted"
                )
            before, key_before = name, key
            self._count += 1
        if not self._count:
            raise UsageError(f"{path}: no input found: the list is empty")

    def __len__(self) -> int:
        return self._count

    def names(self, places: range) -> Iterator[str]:
        """Yield the names at these places, which increase."""
        if not places:
            return
        first = places[0] // _BLOCK
        at = first * _BLOCK
        wanted = iter(places)
        place = next(wanted)
        for _, name in self._lines(self._places[first]):
            if at == place:
                yield name
                place = next(wanted, -1)
                if place < 0:
                    return
            at += 1

    def _lines(self, offset: int, places: "array[int] | None" = None) -> Iterator[tuple[int, str]]:
        """Yield each name from an offset on, and the number of its line there; note where blocks begin."""
        count = 0
        try:
            with Path(self._path).open("rb") as file:
                file.seek(offset)
                for number, line in enumerate(file, 1):
                    if name := line.rstrip(b"\r\n"):
                        if places is not None and count % _BLOCK == 0:
                            places.append(offset)
                        count += 1
                        yield number, os.fsdecode(name)
                    offset += len(line)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise UsageError(f"{self._path}: the list of files cannot be read: {reason}") from error
