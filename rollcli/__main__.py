"""``python -m rollcli``: the same program as ``rollcli``."""

import os
import sys
from pathlib import Path
from types import TracebackType


def main() -> None:
    """Run the program; should it fail for a reason that nobody thought of, that is one line too."""
    sys.excepthook = _one_line
    if sys.stderr is None:  # closed: what we say goes nowhere
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 (open as long as the program runs)
    from rollcli.cli.main import main as program  # here: each worker process imports this module anew

    program(prog_name="rollcli")


def _one_line(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    if issubclass(kind, KeyboardInterrupt):  # before there was anything to resume
        sys.stderr.write("rollcli: interrupted\n")
        return
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    where = f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}" if at else "nowhere"
    sys.stderr.write(f"rollcli: internal error, please report it: {kind.__name__}: {error} ({where})\n")


if __name__ == "__main__":
    main()
