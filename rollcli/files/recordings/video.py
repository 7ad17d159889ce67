"""Videos: their frames, decoded in order.

How many there are is told by the packets of the file, which costs nothing; where its edit list leaves some
out, and of two videos that pair up by number, by decoding them once. A packet that is damaged inside may give
no frame: then the last ones that were counted are errors.

A video cannot be sought exactly: where rates vary, or frames refer to later ones, another frame comes.
So frames are decoded in their order, from the start, by the process that hands them out (`Work.prepare`), and
a resumed run passes over those that are done. Only on a cluster does each worker decode for itself.
"""

import contextlib
import os
import struct
import threading
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import cv2
from numpy.typing import NDArray

from rollcli.errors import InputError, UsageError, about
from rollcli.files.bounded import state_of
from rollcli.files.codecs.arrays import require_decoded_fits
from rollcli.files.codecs.pictures import half_size
from rollcli.files.naming import Input, gathered
from rollcli.files.stores.locations import require_local

_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip", b"styp")  # that MP4 and MOV begin with
_EBML, _SEGMENT = 0x1A45DFA3, 0x18538067  # Matroska's
_MOST_EDITS = 1000
_SILENT = 0  # OpenCV's level
_SETTINGS = threading.Lock()  # OpenCV has one set of them for all threads
_OPTIONS_NAME = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
# a packet that is cut off makes no frame, and what a file names elsewhere is not followed
_OPTIONS = "fflags;discardcorrupt|protocol_whitelist;file"
_PACKETS = [cv2.CAP_PROP_FORMAT, -1]  # OpenCV hands them out as they are
_TRIES = 10_000  # packets in a row that give no frame; at the end of a file they take 4 ms
_ALL_THREADS, _ONE_THREAD = ([cv2.CAP_PROP_N_THREADS, each] for each in (os.cpu_count() or 1, 1))


class Video(NamedTuple):
    """What a video has: whole frames, their size in px, and what is wrong behind them, else empty."""

    frames: int
    width: int
    height: int
    broken: str


def _known(source: Input, *, decode: bool) -> Video:
    """Count the frames of a video: the number that its container states is a guess."""
    path = source.location
    return _look_through(*state_of(path), source.name, decode or _leaves_out(path))


@lru_cache(maxsize=4)
def _look_through(path: str, size: int, modified_ns: int, process: int, name: str, decode: bool) -> Video:
    decoder = _Decoder(path, name, _ALL_THREADS if decode else _PACKETS)
    count = 0
    while decoder.grab():
        count += 1
    broken = broken_end(path)
    if count == 0 or not (decode or _Decoder(path, name, _ONE_THREAD).grab()):
        raise InputError(f"{name}: has no frame that can be decoded{broken and f'; it {broken}'}")
    return Video(count, decoder.width, decoder.height, broken)


def frames_of(left: Input, right: Input, layout: str | None) -> list[tuple[Input, Input]]:
    """List the frames of a video that holds both views as `layout` says; or pair those of two by number.

    What is broken behind the frames of a video is one more, which fails and says so.

    Raises
    ------
    UsageError
        A video is in a store; or two differ in size; or in length, and neither is cut off.
    InputError
        One cannot be opened, or has no frame, or one that cannot be halved.
    """
    for each in (left, right):
        require_local(each.location)
    one = _known(left, decode=layout is None)
    if layout is not None:
        half_size(one.width, one.height, layout, left.name)
        return [(each, each) for each in _listed(one, left)]
    other = _known(right, decode=True)
    if (one.width, one.height) != (other.width, other.height):
        raise UsageError(
            f"{left.name} has {one.width}x{one.height} px, {right.name} {other.width}x{other.height}: give "
            "two views of one size"
        )
    if one.frames != other.frames and not (one.broken or other.broken):
        raise UsageError(
            f"{left.name} has {one.frames} frames, {right.name} {other.frames}: they pair up by number, and "
            "behind a frame that one camera dropped all pairs are wrong: cut both to the same moments"
        )
    both = [_listed(video, each) for video, each in ((one, left), (other, right))]
    few = min(one.frames, other.frames)
    ends = [frames[-1] for frames, video in zip(both, (one, other), strict=True) if video.broken]
    return [*zip(both[0][:few], both[1][:few], strict=True), *((end, end) for end in ends)]


def _listed(video: Video, source: Input) -> list[Input]:
    path, stem = source.location, os.path.splitext(source.relative)[0]  # noqa: PTH122
    numbers = [f"{number:06d}" for number in range(video.frames)] + (["rest"] if video.broken else [])
    return [Input(f"{path}#{each}", f"{stem}_{each}.png") for each in numbers]


def read_video_frame(path: str, frame: str, name: str) -> NDArray[Any]:
    """Decode one frame of a video, BGR (H, W, 3); frames that follow each other are read in one pass."""
    if frame == "rest":
        video = _known(Input(path, path), decode=False)  # which says why where it cannot be opened
        if not video.broken and (video.width % 2 or video.height % 2):  # of several: see `frames_of`
            size = f"{video.width}x{video.height} px"
            raise InputError(f"{name}: has frames of {size}, which cannot be halved into two views: cut them")
        raise InputError(f"{name}: {broken_end(path) or 'is whole'}; the whole frames before are used")
    if not frame.isdecimal():
        raise InputError(f"{name}: no such frame in {path}")
    return _decoder(*state_of(path), threading.get_ident()).read(int(frame), name)


@lru_cache(maxsize=8)  # both of a pair, and those of another drive; threads are at places of their own
def _decoder(path: str, size: int, modified_ns: int, process: int, thread: int) -> "_Decoder":
    return _Decoder(path, path, _ONE_THREAD)


close_all = _decoder.cache_clear


class _Decoder:
    """A video that is open."""

    def __init__(self, path: str, name: str, settings: list[int]) -> None:
        self._path, self._name, self._settings = path, name, settings
        self._open()

    def _open(self) -> None:
        with Path(self._path).open("rb") as file:
            if _container(file.read(16)) is None:
                raise InputError(f"{self._name}: is no MP4, MOV, AVI or Matroska file")
        os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # its errors are ours to tell
        path = os.path.abspath(self._path)  # noqa: PTH100
        with _opening():
            self._capture = cv2.VideoCapture(path, cv2.CAP_FFMPEG, self._settings)
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # turned views would not be rectified any more
        self._next = 0
        if not self._capture.isOpened():
            broken = broken_end(self._path) or "has no video that OpenCV decodes, or no index"
            raise InputError(f"{self._name}: cannot be opened: it {broken}")
        sides = (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        self.width, self.height = (int(self._capture.get(side)) for side in sides)
        size = Path(self._path).stat().st_size
        with about(self._name):
            require_decoded_fits(self.width, self.height, 3, size)

    def grab(self) -> bool:
        """Decode the next frame, behind damaged packets too; return whether there is one."""
        found = any(self._capture.grab() for _ in range(_TRIES))
        self._next += found
        return found

    def read(self, number: int, name: str) -> NDArray[Any]:
        """Return a frame as BGR; one before the last that was read makes it begin anew."""
        if number < self._next - 1:
            self._open()
        while self._next <= number:
            if not self.grab():
                raise InputError(f"{name}: no such frame: {self._path} has {self._next} that can be decoded")
        found, values = self._capture.retrieve()
        if not found:
            raise InputError(f"{name}: cannot be decoded")
        return values


@contextlib.contextmanager
def _opening() -> Iterator[None]:
    """Set how OpenCV opens a video, for a moment: a program that uses this opens its own in its own way."""
    with _SETTINGS:
        before, level = os.environ.get(_OPTIONS_NAME), _set_log_level(_SILENT)
        os.environ[_OPTIONS_NAME] = _OPTIONS
        try:
            yield
        finally:
            os.environ.pop(_OPTIONS_NAME)
            if before is not None:
                os.environ[_OPTIONS_NAME] = before
            _set_log_level(level)


def _set_log_level(level: int) -> int:
    """Set how much OpenCV prints, and return how much it did."""
    set_level = getattr(cv2, "setLogLevel", None) or cv2.utils.logging.setLogLevel  # OpenCV 4, or 5
    return int(set_level(level))


def broken_end(path: str) -> str:
    """Say that a video's file is shorter than its container says; empty where it is whole."""
    with Path(path).open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        walk = _container(file.read(16))
        try:
            end = 0 if walk is None else walk(file, size)
        except (struct.error, IndexError):  # amid a header
            end = size + 1
    return f"is cut off: it ends at byte {size}, amid a part of its file" if end > size else ""


def _container(head: bytes) -> Any:
    """Return what finds the end that a container states, by its first bytes; None for others."""
    if head[:4] == b"RIFF" and head[8:12] == b"AVI ":
        return _end_of_avi
    if head[4:8] in _BOXES:
        return _end_of_mp4
    return _end_of_matroska if head[:4] == struct.pack(">I", _EBML) else None


def _end_of_avi(file: BinaryIO, size: int) -> int:
    at = end = 0
    while at + 8 <= size:  # large files have several RIFFs
        file.seek(at)
        mark, length = struct.unpack("<4sI", file.read(8))
        if mark != b"RIFF":
            break
        end = at + 8 + length
        at = end + length % 2
    return end


def _end_of_mp4(file: BinaryIO, size: int) -> int:
    return max((end for _, (_, end) in _walk(file, 0, size)), default=0)


def _leaves_out(path: str) -> bool:
    """Tell whether an MP4 shows less by its edit list than it holds, as one that was cut without encoding.

    [ISO/IEC 14496-12, 8.6.6]
    """
    with Path(path).open("rb") as file:
        file_size = file.seek(0, os.SEEK_END)
        try:
            for movie in _boxes(file, 0, file_size).get(b"moov", ()):
                inside = _boxes(file, *movie)
                scale, _ = _time_of(file, inside[b"mvhd"][0])
                for track in inside.get(b"trak", ()):
                    parts = _boxes(file, *track)
                    for edits in parts.get(b"edts", ()):
                        shown = _shown_by(file, _boxes(file, *edits)[b"elst"][0])
                        per_s, whole = _time_of(file, _boxes(file, *parts[b"mdia"][0])[b"mdhd"][0])
                        if (shown + 1) * per_s < whole * scale:
                            return True
        except (struct.error, KeyError):
            return True
    return False


def _boxes(file: BinaryIO, at: int, end: int) -> dict[bytes, list[tuple[int, int]]]:
    """Return where the contents of the boxes in a part of an MP4 begin and end, by their kind."""
    return gathered(_walk(file, at, end))


def _walk(file: BinaryIO, at: int, end: int) -> Iterator[tuple[bytes, tuple[int, int]]]:
    """Yield the kind of each box in a part of an MP4, and where its content begins and ends."""
    while at + 8 <= end:
        file.seek(at)
        (length, kind), head = struct.unpack(">I4s", file.read(8)), 8
        if length == 1:
            (length,), head = struct.unpack(">Q", file.read(8)), 16
        if length < head:  # 0: up to the end of the file
            length = end - at
        yield kind, (at + head, at + length)
        at += length


def _time_of(file: BinaryIO, box: tuple[int, int]) -> tuple[int, int]:
    """Return ticks a second, and how many of them a movie or a track takes."""
    file.seek(box[0])
    head = file.read(32)
    scale, ticks = struct.unpack_from(">16xIQ" if head[:1] == b"\1" else ">8xII", head, 4)
    return scale, ticks


def _shown_by(file: BinaryIO, box: tuple[int, int]) -> int:
    """Return how long an edit list shows its track, in ticks of the movie."""
    file.seek(box[0])
    long, count = struct.unpack(">B3xI", file.read(8))
    entry = struct.Struct(">Qq4x" if long else ">Ii4x")
    entries = entry.iter_unpack(file.read(min(count, _MOST_EDITS) * entry.size))
    return sum(ticks for ticks, start in entries if start >= 0)


def _end_of_matroska(file: BinaryIO, size: int) -> int:
    at = 0
    while at < size:
        file.seek(at)
        head = file.read(12)
        mark, after = _number(head, 0)
        length, content = _number(head, after)
        bits = 7 * (content - after)
        length &= (1 << bits) - 1
        if length < (1 << bits) - 1:
            at += content + length
        elif mark == _SEGMENT:  # its length is not known: its parts are looked at
            at += content
        else:
            return size + 1  # the cluster in which its recorder died
    return at


def _number(data: bytes, at: int) -> tuple[int, int]:
    """Read one of Matroska's numbers, whose first bit that is set says how long it is; and what follows."""
    length = 9 - data[at].bit_length()
    if at + length > len(data):
        raise IndexError
    return int.from_bytes(data[at : at + length], "big"), at + length
