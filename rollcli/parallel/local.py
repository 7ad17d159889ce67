"""Tasks done on this machine: in this process, or in a pool of others."""

import os
from collections.abc import Generator, Iterable, Sequence

from rollcli.parallel.in_order import Done, Task, Work
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.process_setup import prepare_worker


def done_locally(
    tasks: Sequence[Task], work: Work[Task, Done], jobs: int | None, stop: Stop, held: int | None = None
) -> Generator[Done, None, None]:
    """What each task gives, in order.

    Parameters
    ----------
    tasks, work
        What to do.
    jobs : int or None
        Worker processes; None: the usable processors.
    stop : Stop
        No task is begun once this is asked for.
    held : int, optional
        An open file that the workers keep open.
    """
    jobs = min(jobs or _usable_processors(), len(tasks))
    if jobs <= 1:
        return _here(tasks, work, stop)
    from rollcli.parallel.pool import done_by_pool  # one worker needs no pool

    return done_by_pool(tasks, work, jobs, held, stop)


def _here(tasks: Iterable[Task], work: Work[Task, Done], stop: Stop) -> Generator[Done, None, None]:
    prepare_worker()
    for task in tasks:
        if stop.asked:
            return
        yield work.do(task)


def _usable_processors() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
