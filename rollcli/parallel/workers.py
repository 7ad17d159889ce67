"""Which workers run the tasks, and what those on other machines must see."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SharedPaths:
    """What workers on other machines must see as this process sees it.

    Attributes
    ----------
    files : tuple of str
        A sample of the files that the tasks read; those that do not exist are ignored.
    folders : tuple of str
        Where the tasks write.
    """

    files: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()


@dataclass(frozen=True)
class Workers:
    """Which workers run the tasks.

    Attributes
    ----------
    jobs : int or None
        Processes on this machine; None: one for each usable processor.
    scheduler : str or None
        The address of a Dask scheduler, whose workers are used instead.
    shared : SharedPaths
        What the workers of a cluster must see.
    keep_open : int or None
        A file descriptor that processes on this machine inherit and keep open until they end.
    threads : int
        Tasks that each worker has in hand at once: more than one where they wait for the network. One of
        them computes at a time.
    """

    jobs: int | None = None
    scheduler: str | None = None
    shared: SharedPaths = SharedPaths()
    keep_open: int | None = None
    threads: int = 1
