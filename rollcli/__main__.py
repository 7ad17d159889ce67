"""``python -m rollcli``: the same program as ``rollcli``."""

import contextlib
import os
import sys
from types import TracebackType
from typing import NoReturn

from rollcli.errors import ExitStatus
from rollcli.messages import let_stderr_fail, say
from rollcli.parallel.interrupt import ignore_signals, raise_on_signals


def main() -> None:
    """Run the program; an error that nobody expected is one line too."""
    let_stderr_fail()
    sys.excepthook = _say_in_one_line
    try:
        raise_on_signals()
        from rollcli.cli.main import main as program  # a door: each worker process imports this module anew

        program(prog_name="rollcli")
    except KeyboardInterrupt:  # before there was anything to resume
        say("interrupted")
        _end_interrupted()
    except SystemExit as end:
        if end.code == ExitStatus.INTERRUPTED:
            _end_interrupted()
        raise
    finally:
        ignore_signals()


def _end_interrupted() -> NoReturn:
    """Exit with the status of an interrupted run, at once.

    Python itself would end by SIGINT when the interrupt has passed through `exec`, which every dataclass
    calls while it is made, although it was handled.
    """
    if sys.stdout is not None:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
    os._exit(ExitStatus.INTERRUPTED)


def _say_in_one_line(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    where = f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}" if at else "nowhere"
    say(f"internal error, please report it: {kind.__name__}: {error} ({where})")


if __name__ == "__main__":
    main()
