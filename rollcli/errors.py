"""What can go wrong, as a user would name it, and the exit status that says so.

Every message is one line and says what to do.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from types import TracebackType

_ON_WINDOWS = os.name == "nt"
_WINDOWS_PATH = 259 - 27  # characters of a whole path, less what the name of a temporary file adds


class ExitStatus(IntEnum):
    """How the program ends; the help of every command lists these."""

    meaning: str

    def __new__(cls, value: int, meaning: str) -> "ExitStatus":
        """Make a number that carries its meaning."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member

    DONE = 0, "every frame is done, suspect ones included"
    FAILED = 1, "the program could not do its job: an output cannot be written, the disk is full"
    USAGE = 2, "wrong usage, or no input found"
    FRAMES_FAILED = 3, "finished, and at least one frame failed; each says why"
    CHECK_FAILED = 4, "a check has failed"
    UNTOLD = 5, "no check has failed, and at least one cannot be told"
    INTERRUPTED = 130, "interrupted"


class RollcliError(Exception):
    """Base of every error that rollcli raises on purpose.

    `code` tells apart causes whose errors are raised at one place: a text without names and numbers.
    """

    def __init__(self, message: str = "", code: str = "") -> None:
        super().__init__(message)
        self.code = code


class UsageError(RollcliError):
    """The request contradicts itself or names what is not there (exit status 2)."""


class InputError(RollcliError):
    """A file cannot be read as what it should be; costs that frame, not the batch."""


class EstimationError(RollcliError):
    """The pixels do not determine a roll angle; costs that frame, not the batch."""


class WorkerError(RollcliError):
    """Workers cannot start, or a cluster's cannot do the work (exit status 1)."""


class WorkerDiedError(WorkerError):
    """A worker ended amid its tasks; says what may have killed it. Costs the task that did, not the batch."""


class OutputError(RollcliError):
    """A result cannot be written: the program cannot do its job (exit status 1)."""


def cause_of(error: OSError) -> str:
    """Return what the system says of an error, as the end of a sentence."""
    if isinstance(error, FileExistsError):  # where a folder was to be made
        return f"{error.filename} is no folder"
    return (error.strerror or str(error)).lower()


@contextmanager
def reading(name: str | Path, subject: str = "", kind: type[RollcliError] = InputError) -> Iterator[None]:
    """Take what the system refuses within the block for a failed read of what has this name.

    `subject` is in its sentence what cannot be read, where the name alone does not tell.
    """
    try:
        yield
    except OSError as error:
        raise kind(f"{name}: {subject and f'{subject} '}cannot be read: {cause_of(error)}") from error


def output_error(path: str | Path, error: OSError) -> OutputError:
    """Make the error of a failed write: one line that names the target, not the temporary file."""
    reason = cause_of(error)
    if _ON_WINDOWS and len(str(Path(path).absolute())) > _WINDOWS_PATH:
        reason += f" (Windows takes {_WINDOWS_PATH} characters unless its long paths are switched on)"
    return OutputError(f"{path}: cannot be written: {reason}")


@contextmanager
def writing(path: str | Path) -> Iterator[None]:
    """Take what the system refuses within the block for a failed write of this file."""
    try:
        yield
    except OSError as error:
        raise output_error(path, error) from error


def raised_at(error: BaseException) -> TracebackType | None:
    """Return the innermost step of an error's traceback; None where it was never raised."""
    last = error.__traceback__
    while last is not None and last.tb_next is not None:
        last = last.tb_next
    return last


@contextmanager
def about(name: str | Path) -> Iterator[None]:
    """Name the file that is read within the block in front of what is wrong with it."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{name}: {error}", error.code) from error


@contextmanager
def as_usage() -> Iterator[None]:
    """Take what cannot be read for a wrong request, as it is before a run begins."""
    try:
        yield
    except InputError as error:
        raise UsageError(str(error)) from None
