"""The same done with many things at once, where waiting takes longer than computing. Import-light."""

from collections.abc import Callable, Sequence
from threading import Lock, Thread
from typing import TypeVar

Thing = TypeVar("Thing")
Done = TypeVar("Done")


def in_threads(do: Callable[[Thing], Done], things: Sequence[Thing], most: int) -> list[Done]:
    """Return what `do` makes of each thing, in their order; this thread is one of so many that work.

    The system may start fewer threads: then these do it all. The first error that `do` raises is raised here,
    once all have ended.
    """
    done: dict[int, Done] = {}
    failed: list[Exception] = []
    waiting, lock = iter(enumerate(things)), Lock()

    def work() -> None:
        while not failed:
            with lock:
                following = next(waiting, None)
            if following is None:
                return
            place, thing = following
            try:
                done[place] = do(thing)
            except Exception as error:  # noqa: BLE001 (it is raised where it was asked for)
                failed.append(error)

    threads: list[Thread] = []
    for _ in range(min(most, len(things)) - 1):
        thread = Thread(target=work)
        try:
            thread.start()
        except RuntimeError:  # no memory for a further one
            break
        threads.append(thread)
    work()
    for thread in threads:
        thread.join()
    for error in failed:
        raise error
    return [done[place] for place in range(len(things))]
