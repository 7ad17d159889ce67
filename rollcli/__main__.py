"""``python -m rollcli``: the same program as ``rollcli``.

Functions import what they need, so that a signal during imports is met by `main` and ends in no traceback.
"""

import os
import sys

TYPE_CHECKING = False  # typing, which has it, is not loaded yet
if TYPE_CHECKING:
    from types import TracebackType
    from typing import NoReturn


def main() -> None:
    """Run the program; an error that nobody expected is one line too."""
    sys.excepthook = _say_in_one_line
    # else workers look for Python's own modules in the current folder, which a stranger may have filled
    os.environ.setdefault("PYTHONSAFEPATH", "1")
    try:
        from rollcli.run.workers.interrupt import raise_on_signals

        raise_on_signals()
        from rollcli.messages import let_stderr_fail

        let_stderr_fail()
        from rollcli.cli.main import main as program  # a door: each worker process imports this module anew

        program(prog_name="rollcli")
    except KeyboardInterrupt:  # before there was anything to resume
        _say_interrupted()
    except RuntimeError as error:
        from rollcli.run.workers.interrupt import came_of_interrupt

        if not came_of_interrupt(error):
            raise
        _say_interrupted()
    except SystemExit as end:
        from rollcli.errors import ExitStatus

        if end.code == ExitStatus.INTERRUPTED:
            _end_interrupted()
        raise
    finally:
        from rollcli.run.workers.interrupt import ignore_signals

        ignore_signals()


def _say_interrupted() -> "NoReturn":
    from rollcli.run.workers.interrupt import ignore_signals

    ignore_signals()
    from rollcli.messages import let_stderr_fail, say

    let_stderr_fail()  # the signal may have come before it
    say("interrupted")
    _end_interrupted()


def _end_interrupted() -> "NoReturn":
    """Exit with the status of an interrupted run, at once.

    Python itself would end by SIGINT when the interrupt has passed through `exec`, which every dataclass
    calls while it is made, although it was handled.
    """
    import contextlib

    from rollcli.errors import ExitStatus

    if sys.stdout is not None:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
    os._exit(ExitStatus.INTERRUPTED)


def _say_in_one_line(kind: type[BaseException], error: BaseException, at: "TracebackType | None") -> None:
    from rollcli.messages import say_unexpected

    say_unexpected(error)


if __name__ == "__main__":
    main()
