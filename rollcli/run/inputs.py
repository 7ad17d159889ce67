"""FILE.inputs: what each row of a result was made from, so that a later run knows what has changed since.

Of a result in parts it is a folder, with a file for each part. A line of fixed length stands for each row, in
their order: hashes of the frame's name, of the state of its files (size and time; the entity tag of an
object), and of what they hold; its calibration counts as both. Import-light.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from hashlib import blake2b
from typing import NamedTuple

from rollcli.errors import InputError, RollcliError
from rollcli.files.results import part_name
from rollcli.files.storage import Note, noting, read_frame, state_of
from rollcli.files.stores.locations import is_object_url, is_url
from rollcli.files.stores.objects import list_tags
from rollcli.run.frame import Frame
from rollcli.run.result_file import data_of

_PART_ENDING = "inputs"
_HEX = 16
_WIDTH = 3 * (_HEX + 1)
_UNKNOWN = b"-" * _HEX
_LINE = re.compile(rb"([0-9a-f]{16} )([0-9a-f]{16}|-{16}) ([0-9a-f]{16}|-{16})\n")


def inputs_path(result: str) -> str:
    """Return where it lies."""
    return f"{result}.inputs"


def part_inputs_path(result: str, number: int) -> str:
    """Return where the lines of a part lie."""
    return f"{inputs_path(result)}/{part_name(number, _PART_ENDING)}"


def is_part_inputs(path: str) -> bool:
    """Tell whether a file is named like one with the lines of a part."""
    return path.endswith(f".{_PART_ENDING}")


def is_inputs(path: str) -> bool:
    """Tell whether a new run may write its lines here: there is no file, an empty one, or one of a run."""
    data = data_of(path, _WIDTH)
    return _LINE.match(data) is not None if data else True


class _Line(NamedTuple):
    """The fields of a line, each `_HEX` bytes; unknown where nothing told."""

    name: bytes
    state: bytes = _UNKNOWN
    content: bytes = _UNKNOWN

    @property
    def text(self) -> bytes:
        return b" ".join(self) + b"\n"


def inputs_line(frame: Frame, notes: Mapping[str, Note], at: Callable[[str], str] = str) -> bytes:
    """Make the line of a frame; of one whose files were not all read, it says nothing of them.

    Parameters
    ----------
    frame : Frame
    notes : mapping from str to Note
        What was read for it, by location.
    at : callable
        Locates a path of the frame on this machine.
    """
    return _described(frame, notes, at).text


def _described(frame: Frame, notes: Mapping[str, Note], at: Callable[[str], str]) -> _Line:
    found = []
    for path in frame.reads():
        note = notes.get(at(path))
        if note is None and path == frame.mask:  # that of the frame before, which is not read again
            note = _mask_note(at(path), state_of(at(path)))
        if note is None:
            return _Line(_name(frame))
        found.append(note)
    content = [repr(frame.calibration), *(f"{note.size} {note.crc}" for note in found)]
    return _Line(_name(frame), _state(frame, (note.state for note in found)), _hash(content))


@lru_cache(maxsize=1)
def _mask_note(path: str, state: str) -> Note | None:
    return _read([path]).get(path)


def _read(paths: Iterable[str]) -> dict[str, Note]:
    """Read files for their notes; one that cannot be read has none."""
    with noting() as notes:
        for path in paths:
            try:
                read_frame(path)
            except InputError:
                break
    return notes


def _name(frame: Frame) -> bytes:
    return _hash([frame.file, frame.right_file])


def _state(frame: Frame, states: Iterable[str]) -> bytes:
    every = [repr(frame.calibration), *states]
    return _hash(every) if all(every) else _UNKNOWN


def _hash(texts: Iterable[str]) -> bytes:
    data = "\0".join(texts).encode("utf-8", "surrogateescape")
    return blake2b(data, digest_size=_HEX // 2).hexdigest().encode()


def split_lines(data: bytes) -> list[bytes]:
    """Return the lines of rows."""
    return [data[at : at + _WIDTH] for at in range(0, len(data), _WIDTH)]


class Inputs:
    """The lines of an interrupted or earlier run, and those of the rows that are kept of it.

    Parameters
    ----------
    data : bytes
        Those of the run.
    updates : bool, optional
        Whether objects are looked at too, and what could not be read counts as changed.

    Attributes
    ----------
    lines : bytearray
        Those that were taken, with the state that the files have now where they hold the same.
    """

    def __init__(self, data: bytes, *, updates: bool = False) -> None:
        self.lines = bytearray()
        self._updates = updates
        self._data = data
        self._places: dict[bytes, int] = {}
        self._tags: dict[str, dict[str, str]] = {}

    def take(self, frame: Frame) -> bool:
        """Take the line of the frame that comes next; tell whether there is one."""
        wanted = _name(frame)
        line = self._line_at(len(self.lines), wanted) or self._line_at(self._place_of(wanted), wanted)
        self.lines += line
        return bool(line)

    def take_unknown(self, frame: Frame) -> None:
        """Take a line that knows nothing of the frame that comes next."""
        self.lines += _Line(_name(frame)).text

    def has_changed(self, frame: Frame) -> bool:
        """Tell whether the frame whose line was taken last holds something else than its row was made from.

        Its files are read where their state is not the same; the line gets the new one if they still are.
        """
        was = _Line(*bytes(self.lines[-_WIDTH:-1]).split(b" "))
        if was.content == _UNKNOWN:
            return self._updates
        if not self._updates and any(map(is_url, frame.reads())):  # that would take as long as reading them
            return False
        state = _state(frame, map(self._state_of, frame.reads()))
        if was.state == state != _UNKNOWN:
            return False
        now = _described(frame, _read(frame.reads()), str)
        if now.content != was.content:
            return True
        self.lines[-_WIDTH:] = now.text
        return False

    def _line_at(self, place: int, name: bytes) -> bytes:
        """Return the line of this name at a place; empty where another, a damaged one or none is there."""
        line = self._data[place : place + _WIDTH]
        return line if line.startswith(name) and _LINE.fullmatch(line) else b""

    def _place_of(self, name: bytes) -> int:
        """Find the line of a name, where frames were added or have gone since."""
        data = self._data
        if not self._places:
            self._places = {data[at : at + _HEX]: at for at in range(0, len(data), _WIDTH)}
        return self._places.get(name, len(data))

    def _state_of(self, path: str) -> str:
        if not is_object_url(path):
            return state_of(path)
        folder = path[: path.rindex("/") + 1]
        if folder not in self._tags:
            try:
                self._tags = {folder: dict(list_tags(folder))}
            except RollcliError:  # it may not be listed: then its objects are read
                self._tags = {folder: {}}
        return self._tags[folder].get(path, "")
