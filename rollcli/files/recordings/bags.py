"""The records of ROS 1 bags, MCAP files and sqlite3 bags, read by their places: whole files and broken ones.

The containers are walked here and not by `rosbags`, which refuses a file whose end is missing, or one of
whose definitions it cannot parse: what is whole in such a file is read all the same. A message's place, two
whole numbers, lets any process read it alone: the chunk's offset and the message's number in it, or the row's
number.
"""

import bz2
import sqlite3
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, Protocol

from rollcli.errors import InputError
from rollcli.files.bounded import MOST_BYTES, most_unpacked

_BEGINNING = 64  # bytes: a header's time and more
_MCAP, _BAG, _SQLITE = b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0"


@dataclass(frozen=True)
class Topic:
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
    place: tuple[int, int]
    data: memoryview


class Bag(Protocol):
    """A bag that is open. `broken` says what was found wrong behind the whole messages; else it is empty."""

    broken: str

    def topics(self) -> dict[str, Topic]:
        """Return the topics by name."""

    def messages(self, topics: set[str], begins: Collection[str] = ()) -> Iterator[Message]:
        """Yield every whole message of some topics, in the file's order; of some the beginning will do."""

    def read(self, place: tuple[int, int]) -> Message:
        """Read one message."""


def open_bag(path: str) -> Bag:
    """Open a bag by its first bytes.

    Raises
    ------
    InputError
        It is none, or cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            head = file.read(16)
        if head.startswith(_MCAP):
            return _Mcap(path)
        if head.startswith(_BAG):
            return _Ros1(path)
        if head == _SQLITE:
            return _Sqlite(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from None
    what = "is empty" if not head else "is no ROS 1 bag, MCAP file or sqlite3 bag"
    raise InputError(f"{path}: {what}")


class _BrokenError(Exception):
    """What follows in the file is not whole."""


def _exactly(file: BinaryIO, count: int) -> bytes:
    data = file.read(count) if 0 <= count <= MOST_BYTES else b""
    if len(data) != count:
        raise _BrokenError
    return data


def _unpacked(compression: str, data: memoryview, size: int) -> memoryview:
    """Unpack a chunk, or what is there of it, to no more than it claims and its bytes may stand for."""
    if compression in ("", "none"):
        return data
    if not 0 <= size <= most_unpacked(len(data)):
        raise _BrokenError
    found: bytes | bytearray = b""
    try:
        if compression == "bz2":
            found = bz2.BZ2Decompressor().decompress(data, size)
        elif compression == "lz4":
            from lz4.frame import LZ4FrameDecompressor

            found = LZ4FrameDecompressor().decompress(data, size)
        elif compression == "zstd":
            import zstandard

            found = zstandard.ZstdDecompressor().stream_reader(data).read(size)
    except Exception as error:  # each library has errors of its own
        raise _BrokenError from error
    return memoryview(found)


_DAMAGED = (_BrokenError, struct.error, ValueError, KeyError, IndexError)


class _Records(NamedTuple):
    """Messages of a record (channel, log time, bytes); where the next one begins; whether it is whole."""

    messages: list[tuple[int, int, memoryview]]
    after: int
    whole: bool = True


class _Chunked:
    """A file of chunks that hold messages; subclasses know how records look."""

    def __init__(self, path: str) -> None:
        self.path, self.broken = path, ""
        self._file = Path(path).open("rb")  # noqa: SIM115 (open as long as the process reads from it)
        self._size = Path(path).stat().st_size
        self._topics: dict[int, Topic] = {}
        self._chunk = -1, _Records([], 0)

    def __del__(self) -> None:
        if hasattr(self, "_file"):
            self._file.close()

    def topics(self) -> dict[str, Topic]:
        """Return the topics by name: as the index says, or what a whole look through the file finds."""
        try:
            index = self._index()
            while 0 < index < self._size:
                found = self._record(index)
                index = found.after if found.whole else 0
        except _DAMAGED:
            index = 0
        if not (index and self._topics and all(each.type for each in self._topics.values())):
            for _ in self.messages(set()):
                pass
        return {each.name: each for each in self._topics.values()}

    def messages(self, topics: set[str], begins: Collection[str] = ()) -> Iterator[Message]:
        """Yield every whole message of some topics, in the order of the file."""
        offset = self._start()
        try:
            while offset < self._size:
                found = self._record(offset)
                for number, (channel, time, data) in enumerate(found.messages):
                    topic = self._topics.get(channel)
                    if topic is not None and topic.name in topics:
                        yield Message(topic.name, time, (offset, number), data)
                if not found.whole:
                    raise _BrokenError
                if found.after <= offset:  # the end of the messages
                    return
                offset = found.after
        except _DAMAGED:
            share = offset / max(self._size, 1)
            self.broken = f"is damaged or cut off at {share:.0%} of its {self._size} bytes"

    def read(self, place: tuple[int, int]) -> Message:
        """Read one message."""
        offset, number = place
        try:
            if self._chunk[0] != offset:
                self._chunk = offset, self._record(offset)
            channel, time, data = self._chunk[1].messages[number]
        except _DAMAGED:
            raise InputError(f"{self.path}: there is no whole message at byte {offset}") from None
        topic = self._topics.get(channel)
        return Message(topic.name if topic else "", time, place, data)

    def _start(self) -> int:
        raise NotImplementedError

    def _index(self) -> int:
        """Return where topics are listed behind the messages; 0 where they are not."""
        raise NotImplementedError

    def _record(self, offset: int) -> _Records:
        """Read the record at an offset, and of one that is cut off what is whole in it."""
        raise NotImplementedError


class _Mcap(_Chunked):
    """[https://mcap.dev/spec]: records of an opcode, a length and content; messages lie in chunks or bare."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self._schemas: dict[int, str] = {}

    def _start(self) -> int:
        return len(_MCAP)

    def _index(self) -> int:
        self._file.seek(max(self._size - 37, 0))  # the footer: opcode, length, where the summary starts, …
        opcode, start = struct.unpack_from("<B8xQ", _exactly(self._file, 17))
        return int(start) if opcode == 0x02 else 0

    def _record(self, offset: int) -> _Records:
        self._file.seek(offset)
        opcode, length = struct.unpack("<BQ", _exactly(self._file, 9))
        after = offset + 9 + length
        if opcode in (0x02, 0x0F):  # footer, end of data
            return _Records([], -1)
        if opcode not in (0x03, 0x04, 0x05, 0x06):
            return _Records([], after, after <= self._size)
        if opcode != 0x06:
            return _Records(self._inner(opcode, memoryview(_exactly(self._file, length))), after)
        if length > MOST_BYTES:
            raise _BrokenError
        content = memoryview(self._file.read(length))
        size, name_length = struct.unpack_from("<Q4xI", content, 16)
        start = 32 + name_length + 8
        data = _unpacked(bytes(content[32 : 32 + name_length]).decode(), content[start:], size)
        found, at = list[tuple[int, int, memoryview]](), 0
        while at + 9 <= len(data):
            opcode, length = struct.unpack_from("<BQ", data, at)
            if at + 9 + length > len(data):
                break
            found += self._inner(opcode, data[at + 9 : at + 9 + length])
            at += 9 + length
        return _Records(found, after, at == len(data) == size)

    def _inner(self, opcode: int, content: memoryview) -> list[tuple[int, int, memoryview]]:
        if opcode == 0x05:
            channel, time = struct.unpack_from("<H4xQ", content)
            return [(channel, time, content[22:])]
        if opcode == 0x03:
            (number,) = struct.unpack_from("<H", content)
            self._schemas[number] = _text(content, 2)[0]
        elif opcode == 0x04:
            number, schema = struct.unpack_from("<HH", content)
            name, at = _text(content, 4)
            encoding = _text(content, at)[0]
            kind = self._schemas.get(schema, "").replace("/msg/", "/")
            self._topics[number] = Topic(name, kind, encoding)
        return []


def _text(content: memoryview, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", content, at)
    return bytes(content[at + 4 : at + 4 + length]).decode("utf-8", "replace"), at + 4 + length


class _Ros1(_Chunked):
    """[http://wiki.ros.org/Bags/Format/2.0]: records of fields and data; messages lie in chunks or bare."""

    def _start(self) -> int:
        return len(_BAG)

    def _index(self) -> int:
        self._file.seek(len(_BAG))
        (length,) = struct.unpack("<I", _exactly(self._file, 4))
        return int(struct.unpack("<Q", _fields(_exactly(self._file, length))["index_pos"])[0])

    def _record(self, offset: int) -> _Records:
        self._file.seek(offset)
        (length,) = struct.unpack("<I", _exactly(self._file, 4))
        fields = _fields(_exactly(self._file, length))
        (length,) = struct.unpack("<I", _exactly(self._file, 4))
        after, op = self._file.tell() + length, fields["op"][0]
        if fields.get("encryptor"):
            raise InputError(f"{self.path}: is encrypted: decrypt it first (rosbag decrypt)")
        if op not in (0x02, 0x05, 0x07):
            return _Records([], after, after <= self._size)
        if op != 0x05:
            return _Records(self._inner(op, fields, memoryview(_exactly(self._file, length))), after)
        if length > MOST_BYTES:
            raise _BrokenError
        (size,) = struct.unpack("<I", fields["size"])
        data = _unpacked(fields["compression"].decode(), memoryview(self._file.read(length)), size)
        found, at = list[tuple[int, int, memoryview]](), 0
        while at + 4 <= len(data):
            (length,) = struct.unpack_from("<I", data, at)
            start = at + 4 + length
            if start + 4 > len(data):
                break
            inner = _fields(bytes(data[at + 4 : start]))
            (length,) = struct.unpack_from("<I", data, start)
            if start + 4 + length > len(data):
                break
            found += self._inner(inner["op"][0], inner, data[start + 4 : start + 4 + length])
            at = start + 4 + length
        return _Records(found, after, at == len(data) == size)

    def _inner(
        self, op: int, fields: dict[str, bytes], data: memoryview
    ) -> list[tuple[int, int, memoryview]]:
        if op == 0x02:
            seconds, nanoseconds = struct.unpack("<II", fields["time"])
            return [(struct.unpack("<I", fields["conn"])[0], seconds * 10**9 + nanoseconds, data)]
        if op == 0x07:
            kind = _fields(bytes(data)).get("type", b"").decode("utf-8", "replace")
            name = fields["topic"].decode("utf-8", "replace")
            self._topics[struct.unpack("<I", fields["conn"])[0]] = Topic(name, kind, "ros1")
        return []


def _fields(header: bytes) -> dict[str, bytes]:
    found, at = {}, 0
    while at < len(header):
        (length,) = struct.unpack_from("<I", header, at)
        key, equals, value = header[at + 4 : at + 4 + length].partition(b"=")
        if not equals or at + 4 + length > len(header):
            raise _BrokenError
        found[key.decode("utf-8", "replace")] = value
        at += 4 + length
    return found


class _Sqlite:
    """rosbag2's `.db3`: a table of topics and one of messages."""

    def __init__(self, path: str) -> None:
        self.path, self.broken = path, ""
        self._base: Any = sqlite3.connect(f"{Path(path).resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        # reads what is there of a file that is shorter than it says
        self._base.execute("PRAGMA writable_schema=ON")
        self._names: dict[int, str] = {}

    def __del__(self) -> None:
        if hasattr(self, "_base"):
            self._base.close()

    def topics(self) -> dict[str, Topic]:
        """Return the topics by name."""
        try:
            rows = self._base.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: its table of topics cannot be read: {error}") from None
        self._names = {number: name for number, name, *_ in rows}
        return {name: Topic(name, kind.replace("/msg/", "/"), form) for _, name, kind, form in rows}

    def messages(self, topics: set[str], begins: Collection[str] = ()) -> Iterator[Message]:
        """Yield every whole message of some topics, in the file's order; of some the beginning will do."""
        self.topics()
        count, whole = 0, self._is_whole() and hasattr(self._base, "blobopen")  # from Python 3.11 on
        try:
            for number, topic, time in self._base.execute(
                "SELECT id, topic_id, timestamp FROM messages ORDER BY id"
            ):
                name = str(self._names.get(topic))
                if whole and name in begins:
                    with self._base.blobopen("messages", "data", number, readonly=True) as blob:
                        data = blob.read(_BEGINNING)
                elif (
                    name in topics or not whole
                ):  # of a file that is cut off, the first that is not there ends it
                    data = self.read((number, 0)).data
                count += 1
                if name in topics:
                    yield Message(name, int(time), (number, 0), memoryview(data))
        except (sqlite3.Error, InputError):
            self.broken = f"is damaged or cut off behind {count} messages"

    def _is_whole(self) -> bool:
        """Tell whether the file has as many pages as its header says [https://www.sqlite.org/fileformat.html]."""
        with Path(self.path).open("rb") as file:
            size, pages = struct.unpack(">16xH10xI", file.read(32))
        needed: int = pages * (size if size > 1 else 65536)
        return Path(self.path).stat().st_size >= needed

    def read(self, place: tuple[int, int]) -> Message:
        """Read one message."""
        try:
            asked = "SELECT topic_id, timestamp, data FROM messages WHERE id = ?"
            row = self._base.execute(asked, place[:1]).fetchone()
        except sqlite3.Error:
            row = None
        if row is None or not isinstance(row[2], bytes):
            raise InputError(f"{self.path}: there is no whole message {place[0]}")
        return Message(self._names.get(row[0], ""), int(row[1]), place, memoryview(row[2]))


@lru_cache(maxsize=4)  # a process opens a bag once
def opened(path: str, size: int, modified_ns: int, process: int) -> Bag:
    """Open a bag, or return the one that is open; see `bounded.state_of`."""
    return open_bag(path)
