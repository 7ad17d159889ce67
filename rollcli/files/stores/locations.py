"""The parts of a URL, and turns at computing while other tasks wait for the network."""

import contextlib
import os
import posixpath
import re
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from rollcli.errors import UsageError

OBJECT_STORES = ("s3", "gs", "az")
WEB_SERVERS = ("http", "https")
_QUERY, _HOST_END = re.compile("[?#]"), re.compile(r"[/?#\\]")
_ON_WINDOWS = os.name == "nt"
_NOWHERE = re.compile(r"[\0\\]|^[A-Za-z]:")
_NOT_ON_WINDOWS = re.compile(
    r'[<>:"|?*\x00-\x1f]|[. ]$|^(?:con|prn|aux|nul|conin\$|conout\$|com[0-9]|lpt[0-9]) *(?:\.|$)',
    re.IGNORECASE,
)
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")  # two letters or more: "c:/" is a drive of Windows


def is_url(location: str) -> bool:
    """Return whether a location is a URL rather than a local path."""
    return "://" in location and _SCHEME.match(location) is not None


def is_object_url(location: str) -> bool:
    """Return whether a location is a URL of an object store, whose objects can be listed and written."""
    return is_url(location) and scheme_of(location) in OBJECT_STORES


def is_web_url(location: str) -> bool:
    """Return whether a location is a URL of a web server, which has single files to read."""
    return is_url(location) and scheme_of(location) in WEB_SERVERS


def scheme_of(url: str) -> str:
    """Return the scheme of a URL, lower case.

    Raises
    ------
    UsageError
        rollcli cannot read from or write to places of this scheme.
    """
    match = _SCHEME.match(url)
    scheme = match[1].lower() if match else ""
    if scheme not in OBJECT_STORES + WEB_SERVERS:
        known = ", ".join(f"{each}://" for each in OBJECT_STORES + WEB_SERVERS)
        raise UsageError(f"{public_name(url)}: {scheme}:// is not supported; use {known} or a local path")
    return scheme


def split_url(url: str) -> tuple[str, str]:
    """Return the root of an object store's URL (``s3://bucket``) and the key below it.

    Raises
    ------
    UsageError
        The URL has no bucket, or another scheme.
    """
    scheme = scheme_of(url)
    rest = url[len(scheme) + 3 :]
    bucket, _, key = rest.partition("/")
    if "@" in bucket:
        raise UsageError(f"{public_name(url)}: keys go into the environment, not into a URL")
    if not bucket:
        raise UsageError(f"{public_name(url)}: names no bucket; write {scheme}://bucket/prefix")
    return f"{scheme}://{bucket}", key


def store_of(url: str) -> str:
    """Return the scheme and the server or bucket of a URL, as it was written but for case."""
    scheme, _, rest = url.partition("://")
    return f"{scheme}://{_HOST_END.split(rest, maxsplit=1)[0]}".lower()


def is_remote(location: str) -> bool:
    """Return whether reading a location asks another machine by its name: a URL, or a share of Windows."""
    share = _ON_WINDOWS and location.replace("\\", "/").startswith("//")
    return share or is_url(location)


def require_local(location: str, why: str = "recordings are read from local disk: download it first") -> None:
    """Refuse a place in a store where one on a disk is needed, such as that of a recording.

    Raises
    ------
    UsageError
    """
    if is_url(location):
        raise UsageError(f"{public_name(location)}: {why}")


def public_name(location: str) -> str:
    """Return a location as messages, rows and records show it: without passwords and signatures."""
    if not is_url(location):
        return location
    scheme, _, rest = location.partition("://")
    if scheme.lower() not in OBJECT_STORES:  # whose keys may hold "?" and "#"
        rest = _QUERY.split(rest, maxsplit=1)[0]
    host, slash, path = rest.partition("/")
    return f"{scheme}://{host.rpartition('@')[2]}{slash}{path}"


def names_a_file(relative: str) -> bool:
    """Return whether a decoded path of a URL names a file below a folder, and nothing else.

    By the rules of every system: with a backslash, or a drive at its start, it would lead elsewhere on
    Windows. Devices, streams and what else Windows alone does not take are refused there.
    """
    parts = relative.split("/")
    if parts[-1] == "" or any(part in (".", "..") or _NOWHERE.search(part) for part in parts):
        return False
    return not (_ON_WINDOWS and any(map(_NOT_ON_WINDOWS.search, parts)))


def located(root: str, location: str) -> str:
    """Return where a location lies for a worker whose relative paths start at `root`."""
    return location if not root or is_url(location) else str(Path(root, location))


def within(folder: str, name: str) -> str:
    """Return where a name lies in a folder, which is a path or a URL."""
    return f"{folder}{name}" if folder.endswith("/") else f"{folder}/{name}"


def base_name(location: str) -> str:
    """Return the last part of a location's path; empty for a URL that is no address."""
    if is_url(location) and scheme_of(location) in WEB_SERVERS:
        try:
            return posixpath.basename(unquote(urlsplit(location).path))
        except ValueError:
            return ""
    return posixpath.basename(location)


# tasks of a worker: with two requests of 50 ms and 10 ms of work a frame, 16 keep up with a disk, and 8
# reach 0.7 of its rate
_IN_HAND = 16
# of their files: a worker takes about 150 ms for 1 MB of PNG, so that two tasks of 8 MB keep it busy; a task
# that waits takes some 25 times the memory of its files
_BYTES_IN_HAND = 16 * 2**20
_turn = threading.Lock()
_room = threading.Condition()
_held_bytes: dict[int, int] = {}  # by thread, that of the oldest task first
_mine = threading.local()


def tasks_in_hand(locations: Iterable[str]) -> int:
    """Return how many tasks a worker should have in hand at once, from what they read and write."""
    return _IN_HAND if any(map(is_url, locations)) else 1


@contextlib.contextmanager
def computing() -> Iterator[None]:
    """Wait for this thread's turn, and have it until the block ends."""
    with _turn:
        _mine.held = True
        try:
            yield
        finally:
            _mine.held = False
            with _room:
                _held_bytes.pop(threading.get_ident(), None)
                _room.notify_all()


@contextlib.contextmanager
def waiting_for_network() -> Iterator[None]:
    """Give this thread's turn, if it has one, to others until the block ends."""
    if not getattr(_mine, "held", False):
        yield
        return
    _turn.release()
    try:
        yield
    finally:
        _turn.acquire()


def wait_for_room(size: int) -> None:
    """Wait until this thread's task may hold so many bytes more; it holds them until it ends.

    Call it while waiting for the network: the tasks that make room need the turn.
    """
    if not getattr(_mine, "held", False):
        return
    task = threading.get_ident()
    with _room:
        _room.wait_for(lambda: _has_room(task, size))
        _held_bytes[task] = _held_bytes.get(task, 0) + size
        _room.notify_all()


def _has_room(task: int, size: int) -> bool:
    oldest = next(iter(_held_bytes), task)
    return oldest == task or sum(_held_bytes.values()) + size <= _BYTES_IN_HAND
