"""System calls that fail when they are told to, in a process of their own.

Python's own files make theirs in C, out of reach; `_pyio`, the same in Python, goes through `os`.
"""

import _pyio
import builtins
import errno
import fcntl
import io
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

# what each call may fail with; "short" writes half and says so
FAULTS = {
    "open": ("EIO", "ENOSPC", "EROFS"),
    "write": ("EIO", "ENOSPC", "EDQUOT", "short"),
    "read": ("EIO",),
    "close": ("EIO", "ENOSPC"),
    "replace": ("EIO", "ENOSPC", "EROFS"),
    "link": ("EIO", "ENOSPC", "EPERM"),
    "ftruncate": ("EIO",),
    "unlink": ("EIO", "EROFS"),
    "mkdir": ("EIO", "ENOSPC", "EDQUOT"),
    "stat": ("EIO",),
    "lstat": ("EIO",),
    "fstat": ("EIO",),
    "scandir": ("EIO",),
    "fsync": ("EIO",),
    "flock": ("EIO", "ENOLCK"),
}


class Fault(NamedTuple):
    """The `number`-th call of a kind fails, counted from 1 and only in the folder watched."""

    call: str
    number: int
    error: str


class FaultyCalls:
    """The calls of this process on files below a folder: counted, and one of them failing.

    Parameters
    ----------
    folder : Path
        Calls on other files are not counted.
    fault : Fault or None
    """

    def __init__(self, folder: Path, fault: Fault | None) -> None:
        self._folder, self._fault = str(folder), fault
        self._open: set[int] = set()
        self.counts: Counter[str] = Counter()

    def install(self) -> None:
        """Replace the functions; there is no way back."""
        for name in FAULTS:
            owner = fcntl if name == "flock" else os
            setattr(owner, name, self._wrapped(name, getattr(owner, name)))
        os.rename, os.remove = os.replace, os.unlink
        builtins.open = io.open = _pyio.open  # type: ignore[assignment]

    def _wrapped(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def wrapper(target: Any, *rest: Any, **named: Any) -> Any:
            if not self._is_watched(target):
                return call(target, *rest, **named)
            self.counts[name] += 1
            fault = self._fault
            if fault is None or (name, self.counts[name]) != fault[:2]:
                return self._noted(name, target, call(target, *rest, **named))
            if fault.error == "short":
                return call(target, rest[0][: max(1, len(rest[0]) // 2)])
            if name == "close":  # what is written is lost, and the file is closed all the same
                self._noted(name, target, call(target))
            number = getattr(errno, fault.error)
            raise OSError(number, os.strerror(number), str(target))

        return wrapper

    def _noted(self, name: str, target: Any, result: Any) -> Any:
        if name == "open":
            self._open.add(result)
        elif name == "close":
            self._open.discard(target)
        return result

    def _is_watched(self, target: Any) -> bool:
        if isinstance(target, int):
            return target in self._open
        try:
            return os.path.abspath(os.fsdecode(target)).startswith(self._folder)  # noqa: PTH100 (no Path here)
        except TypeError:
            return hasattr(target, "fileno") and target.fileno() in self._open
