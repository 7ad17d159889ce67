"""``python -m rollcli``: the same program as ``rollcli``."""

import sys
from types import TracebackType

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
        sys.exit(ExitStatus.INTERRUPTED)
    finally:
        ignore_signals()


def _say_in_one_line(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    where = f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}" if at else "nowhere"
    say(f"internal error, please report it: {kind.__name__}: {error} ({where})")


if __name__ == "__main__":
    main()
