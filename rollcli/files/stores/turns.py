"""Take turns at computing: while one task of a process waits for the network, another one computes.

A request to an object store takes ten times as long as the work on a map. A worker process therefore runs
a few tasks in threads of their own. Only the task whose turn it is computes; a task that waits for a store
gives its turn to the next. Outside of `computing`, waiting changes nothing.
"""

import contextlib
import threading
from collections.abc import Iterable, Iterator

from rollcli.files.stores.locations import is_url

_IN_HAND = 8  # tasks of a worker: with 50 ms a request and 10 ms of work, five keep it busy
_turn = threading.Lock()
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
