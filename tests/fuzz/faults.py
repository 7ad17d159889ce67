"""Let every system call of a run fail once, and look at how the run ends and what a resume makes of it.

Whatever fails, the run ends with a documented status and without an internal error, and `--resume` ends with
the bytes of a run that nothing disturbed; only a frame that could not be read stays an error. Runs write one
file, or parts.
"""

import argparse
import contextlib
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rollcli.files.results import Row, read_result
from tests.fuzz.faulty import FAULTS, Fault, FaultyCalls
from tests.run_cli import contents, write_maps

ARGUMENTS = ("estimate", "maps", "-q", "-j1", "--derotated", "out/up", "--vdisparity", "out/v")
RESULTS = {"rolls.csv": (), "rolls.parquet": ("--part-rows", "3")}
STATUSES = (0, 1, 2, 3)
FRAMES = 4


class Ended(NamedTuple):
    """How a run ended: status, what it said, and how often it made each call."""

    status: int
    said: str
    counts: Counter[str]


class Bench:
    """A folder with maps, and what a run without faults makes of it; `result` is one of `RESULTS`."""

    def __init__(self, folder: Path, result: str) -> None:
        self.folder, self.result = folder.resolve(), result
        self._arguments = (*ARGUMENTS, "-o", f"out/{result}", *RESULTS[result])
        write_maps(self.folder / "maps", FRAMES, width=64, height=48)
        self.whole = self.run(None)
        assert self.whole.status == 0, self.whole.said
        self.expected, self._whole_rows = contents(self.folder / "out"), self._rows()

    def faults(self, step: int = 1) -> Iterator[Fault]:
        """Every `step`-th call of each kind with one error, or with `step` 1 each call with every error."""
        number = 0
        for call, errors in FAULTS.items():
            for at in range(1, self.whole.counts[call] + 1):
                for error in errors:
                    if number % step == 0:
                        yield Fault(call, at, error)
                    number += 1

    def problem(self, fault: Fault) -> str:
        """What is wrong about the way a run deals with a fault; empty when nothing is."""
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        ended = self.run(fault)
        if ended.status not in STATUSES or "internal error" in ended.said or "Traceback" in ended.said:
            return f"ended with {ended.status}: {ended.said}"
        resumed = self.run(None, "--resume")
        if "internal error" in resumed.said or "Traceback" in resumed.said or resumed.status not in STATUSES:
            return f"resumed with {resumed.status}: {resumed.said}"
        found = contents(self.folder / "out")
        if found == self.expected:
            return ""
        if ended.status == resumed.status == 3 and self._only_errors_differ(found):
            return ""
        if ended.status == 3 and resumed.status == 2 and "the inputs differ" in resumed.said:
            return ""  # the folder of the maps could not be looked at: its row says so
        odd = sorted(
            name for name in found.keys() | self.expected if found.get(name) != self.expected.get(name)
        )
        return (
            f"{ended.status} ({ended.said}), then {resumed.status} ({resumed.said}): {', '.join(odd)} differ"
        )

    def run(self, fault: Fault | None, *more: str) -> Ended:
        """Run the program in a copy of this process, which has loaded everything already."""
        ends, starts = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(ends)
            _be_the_program(self.folder, fault, (*self._arguments, *more), starts)
        os.close(starts)
        with open(ends, "rb") as file:  # noqa: PTH123 (a descriptor)
            said, _, counts = file.read().decode(errors="replace").rpartition("\0")
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        pairs = (each.split("=") for each in counts.split())
        return Ended(status, said.strip(), Counter({name: int(count) for name, count in pairs}))

    def _rows(self) -> tuple[Row, ...]:
        return read_result(self.folder / "out" / self.result).rows

    def _only_errors_differ(self, found: dict[str, bytes]) -> bool:
        """Whether rows differ only where a frame could not be read, and images only by being absent."""
        rows = self._rows()
        differ = [row for row, other in zip(rows, self._whole_rows, strict=False) if row != other]
        images = [name for name in found if name.endswith(".png")]
        return (
            len(rows) == len(self._whole_rows)
            and all(row.status == "error" for row in differ)
            and all(found[name] == self.expected.get(name) for name in images)
        )


def _be_the_program(folder: Path, fault: Fault | None, arguments: tuple[str, ...], answers: int) -> None:
    """Run it to the end of this process; what it says and its counts go to a pipe."""
    from rollcli.__main__ import _say_in_one_line
    from rollcli.cli.main import main

    status = 70
    for stream in (1, 2):
        os.dup2(answers, stream)
    sys.stdout = os.fdopen(1, "w", closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
    calls = FaultyCalls(folder, fault)
    with contextlib.suppress(BaseException):
        os.chdir(folder)
        calls.install()
        try:
            main(list(arguments), prog_name="rollcli")
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException as error:  # noqa: BLE001 (whatever gets here is the find)
            _say_in_one_line(type(error), error, error.__traceback__)
    counts = " ".join(f"{name}={count}" for name, count in calls.counts.items())
    sys.stderr.flush()
    sys.stdout.write("\0" + counts)
    sys.stdout.flush()
    os._exit(status)


def main(step: int = 1) -> int:
    """Try every `step`-th fault; 1 when something was found."""
    tried, finds = 0, 0
    for result in RESULTS:
        with tempfile.TemporaryDirectory() as name:
            bench = Bench(Path(name), result)
            print(f"{result}: calls:", *sorted(bench.whole.counts))
            for fault in bench.faults(step):
                tried += 1
                if problem := bench.problem(fault):
                    finds += 1
                    print(f"{result}: {fault.call} {fault.number} {fault.error}: {problem}", flush=True)
    print(f"{tried} faults, {finds} finds")
    return 1 if finds else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.faults", description=__doc__)
    parser.add_argument("step", type=int, nargs="?", default=1, help="try one fault of so many (all)")
    sys.exit(main(parser.parse_args().step))
