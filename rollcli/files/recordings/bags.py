"""The records of ROS 1 bags, MCAP files and sqlite3 bags, read by their places: whole files and broken ones.

The containers are walked here and not by `rosbags`, which refuses a file whose end is missing, or one of
whose definitions it cannot parse: what is whole in such a file is read all the same. A message's place, two
whole numbers, lets any process read it alone: the chunk's offset and the message's number in it, or the row's
number.
"""

import bz2
import contextlib
import io
import os
import sqlite3
import struct
import threading
import weakref
from collections.abc import Callable, Collection, Iterator
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, BinaryIO, Literal, NamedTuple

from rollcli.errors import InputError, reading
from rollcli.files.bounded import MOST_BYTES, most_unpacked, state_of

_BEGINNING = 64  # bytes: a header's time and more
_MCAP, _BAG, _SQLITE = b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0"


class Topic(NamedTuple):
    """A topic of a bag.

    Attributes
    ----------
    name : str
    type : str
        Of its messages, without "msg/": "sensor_msgs/Image".
    encoding : str
        How they are serialized: "ros1", "cdr", or what else the file says.
    """

    name: str
    type: str
    encoding: str


class Message(NamedTuple):
    """A message: its topic, when it was recorded (ns), its place in the file, and its bytes."""

    topic: str
    log_time: int
    place: tuple[int, ...]
    data: memoryview


class _BrokenError(Exception):
    """What follows in the file is not whole."""


def _exactly(file: BinaryIO, count: int) -> bytes:
    data = file.read(count) if 0 <= count <= MOST_BYTES else b""
    if len(data) != count:
        raise _BrokenError
    return data


class _Source:
    """The bytes of a record, or of what a chunk holds, taken from their start to their end.

    Attributes
    ----------
    size, left : int
        How many bytes there are, and are left.
    at_once : bool
        Whether all of it is taken.
    """

    def __init__(self, file: BinaryIO, size: int, *, at_once: bool = False) -> None:
        self.size = self.left = size
        self.at_once = at_once
        self._file, self._passed = file, 0

    def take(self, count: int) -> memoryview:
        """Return the next bytes."""
        passed = self._passed
        self.skip(count)
        self._passed = 0
        try:
            if passed and isinstance(self._file, io.BufferedReader):  # what is unpacked is sought slowly
                self._file.seek(passed, os.SEEK_CUR)
            elif passed:
                _exactly(self._file, passed)
            return memoryview(_exactly(self._file, count))
        except Exception as error:  # each library that unpacks has errors of its own
            raise _BrokenError from error

    def skip(self, count: int) -> None:
        """Pass over the next bytes; what lies behind the last that are taken is not read, nor unpacked."""
        if not 0 <= count <= self.left:
            raise _BrokenError
        self.left -= count
        self._passed += count


def _unpacking(compression: str, packed: bytes) -> Any:
    """Return a file whose bytes are unpacked as far as they are read."""
    if compression == "bz2":
        return bz2.BZ2File(io.BytesIO(packed))
    if compression == "lz4":
        from lz4.frame import LZ4FrameFile

        return LZ4FrameFile(io.BytesIO(packed))
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().stream_reader(packed)
    raise _BrokenError


_DAMAGED = (_BrokenError, struct.error, ValueError, KeyError, IndexError)
_Wanted = Callable[[int, int], int]  # of a channel and a message's number: how many of its bytes to read
_ALL = MOST_BYTES


class _Records(NamedTuple):
    """Messages of a record (channel, log time, bytes); where the next one begins; whether it is whole.

    `unpacked`: the messages have all their bytes, whichever were wanted.
    """

    messages: list[tuple[int, int, memoryview]]
    after: int
    whole: bool = True
    unpacked: bool = False


# of a record: whether it holds messages, as a chunk does, or is what stands among them, or else None; where
# the next one begins, which is nowhere behind the last that counts; and a chunk's compression and size
_Head = tuple[Literal["messages", "itself"] | None, int, str, int]


class _Chunked:
    """A file of chunks that hold messages; subclasses know how records look, and at which byte they start.

    Attributes
    ----------
    start : int
        Where the records start.
    _index : callable
        Returns where topics are listed behind the messages; 0 where they are not.
    _head : callable
        Takes a record, where the file stands, up to what it holds.
    _message : callable
        Takes a record up to a message's bytes: its channel, log time and length; None: another record.
    """

    start: int
    _index: Callable[[], int]
    _head: Callable[[], _Head]
    _message: Callable[[_Source], tuple[int, int, int] | None]

    def __init__(self, path: str) -> None:
        self.path, self.broken = path, ""
        self._file = Path(path).open("rb")  # noqa: SIM115 (open as long as the process reads from it)
        self._size = Path(path).stat().st_size
        self._topics: dict[int, Topic] = {}
        self._last = -1, _Records([], -1)  # what was unpacked last, for the next of its messages
        weakref.finalize(self, self._file.close)

    @cached_property
    def topics(self) -> dict[str, Topic]:
        """The topics by name: as the index says, or what a whole look through the file finds."""
        try:
            index = self._index()
            while 0 < index < self._size:
                found = self._record(index, lambda *_: 0)
                index = found.after if found.whole else 0
        except _DAMAGED:
            index = 0
        if not (index and self._topics and all(each.type for each in self._topics.values())):
            list(self.messages(set()))
        return {each.name: each for each in self._topics.values()}

    def messages(self, topics: set[str], begins: Collection[str] = ()) -> Iterator[Message]:
        """Yield every whole message of some topics, in the file's order; of some the beginning will do."""

        def wanted(channel: int, number: int) -> int:
            topic = self._topics.get(channel)
            if topic is None or topic.name not in topics:
                return 0
            return _BEGINNING if topic.name in begins else _ALL

        offset, damaged = self.start, list[int]()
        try:
            while offset <= self._size:
                found = self._record(offset, wanted)
                for number, (channel, time, data) in enumerate(found.messages):
                    if wanted(channel, number):
                        yield Message(self._topics[channel].name, time, (offset, number), data)
                if not found.whole:
                    damaged.append(offset)  # what follows the chunk may be whole
                if found.after <= offset:  # the end of the messages
                    break
                offset = found.after
        except _DAMAGED:
            damaged.append(offset)
        if damaged:
            self.broken = f"is damaged or cut off in what begins at byte {damaged[0]} of its {self._size}"

    def read(self, place: tuple[int, ...]) -> memoryview:
        """Return the bytes of one message."""
        offset, number = place
        try:
            at, found = self._last
            if at != offset:
                found = self._record(offset, lambda _, each: _ALL if each == number else 0, at_once=True)
                self._last = (offset, found) if found.unpacked else self._last
            return found.messages[number][-1]
        except _DAMAGED:
            raise InputError(f"{self.path}: there is no whole message at byte {offset}") from None

    def _content(self, compression: str, packed: int, size: int, *, at_once: bool) -> _Source:
        """Return what a chunk holds: the file stands at its packed bytes.

        It is unpacked to no more than it claims and its bytes may stand for; `at_once` for messages that are
        read one after the other, and where it is cut off, for what is there of it.
        """
        there = min(packed, self._size - self._file.tell())
        if compression in ("", "none"):
            return _Source(self._file, there)
        if there > MOST_BYTES or not 0 <= size <= most_unpacked(there):
            raise _BrokenError
        unpacking = _unpacking(compression, self._file.read(there))
        return _Source(unpacking, size, at_once=at_once or there < packed)

    def _record(self, offset: int, wanted: _Wanted, *, at_once: bool = False) -> _Records:
        """Read the record at an offset, and of one that is cut off what is whole in it."""
        self._file.seek(offset)
        holds, after, compression, size = self._head()
        if holds is None:
            return _Records([], after, after <= self._size)
        if holds == "messages":
            content = self._content(compression, after - self._file.tell(), size, at_once=at_once)
        else:
            self._file.seek(offset)
            size = after - offset
            content = _Source(self._file, min(size, self._size - offset))
        return self._walked(content, wanted, size, after)

    def _walked(self, source: _Source, wanted: _Wanted, size: int, after: int) -> _Records:
        """Return the messages that are whole in a record of a size, each with as many bytes as are wanted."""
        found: list[tuple[int, int, memoryview]] = []
        whole = False
        with contextlib.suppress(*_DAMAGED):
            while source.left:
                if (head := self._message(source)) is not None:
                    channel, time, length = head
                    taken = length if source.at_once else min(wanted(channel, len(found)), length)
                    data = source.take(taken)
                    source.skip(length - taken)
                    found.append((channel, time, data))
            whole = source.size == size
        return _Records(found, after, whole, source.at_once)


class _Mcap(_Chunked):
    """[https://mcap.dev/spec]: records of an opcode, a length and content; messages lie in chunks or bare."""

    start = len(_MCAP)

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self._schemas: dict[int, str] = {}

    def _index(self) -> int:
        self._file.seek(max(self._size - 37, 0))  # the footer: opcode, length, where the summary starts, …
        opcode, start = struct.unpack_from("<B8xQ", _exactly(self._file, 17))
        return int(start) if opcode == 0x02 else 0

    def _head(self) -> _Head:
        opcode, length = struct.unpack("<BQ", _exactly(self._file, 9))
        if not opcode:  # zeros, which a power cut leaves at the end of a file
            raise _BrokenError
        if opcode in (0x02, 0x0F):  # footer, end of data
            return None, -1, "", 0
        after = self._file.tell() + length
        if opcode != 0x06:
            return "itself" if opcode in (0x03, 0x04, 0x05) else None, after, "", 0
        size, name_length = struct.unpack("<16xQ4xI", _exactly(self._file, 32))
        return "messages", after, _exactly(self._file, name_length + 8)[:-8].decode(), size

    def _message(self, source: _Source) -> tuple[int, int, int] | None:
        opcode, length = struct.unpack("<BQ", source.take(9))
        if opcode == 0x05:
            channel, time = struct.unpack("<H4xQ8x", source.take(22))
            return channel, time, length - 22
        if opcode == 0x03:
            content = source.take(length)
            (number,) = struct.unpack_from("<H", content)
            self._schemas[number] = _text(content, 2)[0]
        elif opcode == 0x04:
            content = source.take(length)
            number, schema = struct.unpack_from("<HH", content)
            name, at = _text(content, 4)
            encoding = _text(content, at)[0]
            kind = self._schemas.get(schema, "").replace("/msg/", "/")
            self._topics[number] = Topic(name, kind, encoding)
        else:
            source.skip(length)
        return None


def _text(content: memoryview, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", content, at)
    return bytes(content[at + 4 : at + 4 + length]).decode("utf-8", "replace"), at + 4 + length


class _Ros1(_Chunked):
    """[http://wiki.ros.org/Bags/Format/2.0]: records of fields and data; messages lie in chunks or bare."""

    start = len(_BAG)

    def _index(self) -> int:
        self._file.seek(len(_BAG))
        fields = _fields(_exactly(self._file, self._length()))
        return int(struct.unpack("<Q", fields[b"index_pos"])[0])

    def _head(self) -> _Head:
        if self._file.tell() == self._size:  # no record says that it is the last
            if not 0 < self._index() <= self._size:  # nor has a recorder ended the file
                raise _BrokenError
            return None, -1, "", 0
        fields = _fields(_exactly(self._file, self._length()))
        after = self._length() + self._file.tell()
        op = fields[b"op"][0]
        if fields.get(b"encryptor"):
            raise InputError(f"{self.path}: is encrypted: decrypt it first (rosbag decrypt)")
        if op != 0x05:
            return "itself" if op in (0x02, 0x07) else None, after, "", 0
        return "messages", after, fields[b"compression"].decode(), *struct.unpack("<I", fields[b"size"])

    def _length(self) -> int:
        return int.from_bytes(_exactly(self._file, 4), "little")

    def _message(self, source: _Source) -> tuple[int, int, int] | None:
        fields = _fields(bytes(source.take(*struct.unpack("<I", source.take(4)))))
        (length,) = struct.unpack("<I", source.take(4))
        if fields[b"op"][0] == 0x02:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            return struct.unpack("<I", fields[b"conn"])[0], seconds * 10**9 + nanoseconds, length
        # else a connection: no other record lies among messages
        kind = _fields(bytes(source.take(length))).get(b"type", b"").decode("utf-8", "replace")
        name = fields[b"topic"].decode("utf-8", "replace")
        self._topics[struct.unpack("<I", fields[b"conn"])[0]] = Topic(name, kind, "ros1")
        return None


def _fields(header: bytes) -> dict[bytes, bytes]:
    found, at = {}, 0
    while at < len(header):
        end = at + 4 + struct.unpack_from("<I", header, at)[0]
        key, equals, value = header[at + 4 : end].partition(b"=")
        if not equals or end > len(header):
            raise _BrokenError
        found[key], at = value, end
    return found


# SQLite keeps a value of any type in any column
_TEXTS = ", ".join(f"printf('%s', {each})" for each in ("name", "type", "serialization_format"))
_TIME = "CAST(ifnull(timestamp, 0) AS INTEGER)"


class _Sqlite:
    """rosbag2's `.db3`: a table of topics and one of messages."""

    def __init__(self, path: str) -> None:
        self.path, self.broken = path, ""
        # the threads of a worker, which wait for the network, take turns at reading
        here = Path(path).resolve()
        # what a recorder that was killed had not moved into the base yet lies in its journal
        waits = Path(f"{here}-wal").is_file() and Path(f"{here}-wal").stat().st_size > 0
        where = f"{here.as_uri()}?mode=ro{'' if waits else '&immutable=1'}"
        self._base: Any = sqlite3.connect(where, uri=True, check_same_thread=False)
        weakref.finalize(self, self._base.close)
        # reads what is there of a file that is shorter than it says
        self._base.execute("PRAGMA writable_schema=ON")
        try:
            rows = self._base.execute(f"SELECT id, {_TEXTS} FROM topics").fetchall()
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: its table of topics cannot be read: {error}") from None
        self._names: dict[int, str] = {number: name for number, name, *_ in rows}
        self.topics = {name: Topic(name, kind.replace("/msg/", "/"), form) for _, name, kind, form in rows}

    def messages(self, topics: set[str], begins: Collection[str] = ()) -> Iterator[Message]:
        """Yield every whole message of some topics, in the file's order; of some the beginning will do."""
        count, whole = 0, self._is_whole() and hasattr(self._base, "blobopen")  # from Python 3.11 on
        try:
            for number, topic, time in self._base.execute(
                f"SELECT id, topic_id, {_TIME} FROM messages ORDER BY id"
            ):
                name = str(self._names.get(topic))
                if whole and name in begins:
                    with self._base.blobopen("messages", "data", number, readonly=True) as blob:
                        data = blob.read(_BEGINNING)
                elif name in topics or not whole:  # the first that a file which is cut off has not ends it
                    data = self.read((number, 0))
                count += 1
                if name in topics:
                    yield Message(name, time, (number, 0), memoryview(data))
        except (sqlite3.Error, InputError):
            self.broken = f"is damaged or cut off behind {count} messages"

    def _is_whole(self) -> bool:
        """Tell whether the file has as many pages as its header says [https://www.sqlite.org/fileformat.html]."""
        with Path(self.path).open("rb") as file:
            size, pages = struct.unpack(">16xH10xI", file.read(32))
        needed: int = pages * (size if size > 1 else 65536)
        return Path(self.path).stat().st_size >= needed

    def read(self, place: tuple[int, ...]) -> memoryview:
        """Return the bytes of one message."""
        try:
            row = self._base.execute("SELECT data FROM messages WHERE id = ?", place[:1]).fetchone()
        except sqlite3.Error:
            row = None
        if row is None or not isinstance(row[0], bytes):
            raise InputError(f"{self.path}: there is no whole message {place[0]}")
        return memoryview(row[0])


Bag = _Mcap | _Ros1 | _Sqlite
_KINDS: dict[bytes, type[Bag]] = {_MCAP: _Mcap, _BAG: _Ros1, _SQLITE: _Sqlite}


def opened(path: str) -> Bag:
    """Open a bag by its first bytes, or return the one that is open.

    Its `broken` says what is wrong behind its whole messages, or nothing.

    Raises
    ------
    InputError
        It is none, or cannot be read.
    """
    return _opened(*state_of(path), threading.get_ident())


@lru_cache(maxsize=16)  # a thread opens a bag once: each is at places of its own in the file
def _opened(path: str, size: int, modified_ns: int, process: int, thread: int) -> Bag:
    with reading(path):
        with Path(path).open("rb") as file:
            head = file.read(16)
        for magic, kind in _KINDS.items():
            if head.startswith(magic):
                return kind(path)
    what = "is empty" if not head else "is no ROS 1 bag, MCAP file or sqlite3 bag"
    raise InputError(f"{path}: {what}")


close_all = _opened.cache_clear
