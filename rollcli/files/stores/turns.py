"""Take turns at computing: while one task of a process waits for the network, another one computes.

A request to an object store takes ten times as long as the work on a map. A worker process therefore runs
a few tasks in threads of their own. Only the task whose turn it is computes; a task that waits for a store
gives its turn to the next. What tasks have read ahead is bounded in bytes, too. Outside of `computing`,
neither changes anything.
"""

import contextlib
import threading
from collections.abc import Iterable, Iterator

from rollcli.files.stores.locations import is_url

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
