"""Runs disturbed at random moments and resumed until one ends by itself: the bytes of a run undisturbed?

python tests/benchmarks/bench_kill.py [--count 1000] [--frames 60] [--seed 0] [KIND ...]

A disturbance counts when it has met a living run. A finding is another status than the documented ones, a
traceback or an internal error, a process that outlives its run, a second run that is let in, or, at the end
of a trial, another byte in the result, its record or the images. Trials read a folder of maps, or a bag (with
the extra), or update a whole result of a folder in which maps have changed, were added and have gone. What
ends a run while Python itself still starts is none: then the signal does, or a KeyboardInterrupt in modules
of Python's. Linux alone: it looks into /proc.
"""

import argparse
import contextlib
import itertools
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
import time
from collections import Counter
from collections.abc import Callable
from fcntl import ioctl
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.run_cli import command, contents, environment, road_map, rollcli, write_kitti, write_maps

RESULTS = ("rolls.csv", "rolls.jsonl")
IN_PARTS = "rolls.parquet"
PARTS = ("--part-rows", "4")  # so that workers write some, and others write pieces of one
IMAGES = ("--derotated", "up", "--vdisparity", "v", "--road-mask", "road")
STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_BY_SIGNAL = [-number for number in STOPS]
LONGEST_S = 300  # a run that lasts longer hangs
# the moment: while it starts, or so many images later and within the next frame
STARTING, START_S, MOST_IMAGES, FRAME_S = 0.2, 0.8, 16, 0.03


def _in_front_of(messages: str) -> None:
    """Hear SIGHUP, also where this benchmark was told not to; with a terminal, be its session."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    if messages == "terminal":
        ioctl(2, termios.TIOCSCTTY, 0)


class Task(NamedTuple):
    """What runs are asked for: what they read, how they begin, and what is there before them."""

    inputs: str
    flag: str = "--resume"
    before: Path | None = None


class Run:
    """A run in a session of its own, which writes a result and three images a frame into the folder.

    Parameters
    ----------
    folder : Path
    result : str
    jobs : int
    task : Task
    messages : str
        Where they go: `file`, `pipe` or `terminal`.
    """

    def __init__(self, folder: Path, result: str, jobs: int, task: Task, messages: str = "file") -> None:
        self.folder, self.result, self.jobs, self.task = folder, result, jobs, task
        self.reader, self._began = -1, time.time_ns()
        self._said = folder.with_suffix(".messages")
        self._said.unlink(missing_ok=True)  # those of another run
        if messages == "file":
            writer = os.open(self._said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        elif messages == "pipe":
            self.reader, writer = os.pipe()
        else:
            self.reader, writer = pty.openpty()
        parts = PARTS if result == IN_PARTS else ()
        self.process = subprocess.Popen(
            command(
                *("estimate", task.inputs, "-v", "-o", result, "-j", str(jobs), task.flag, *IMAGES, *parts)
            ),
            cwd=folder,
            env=environment(),
            stdout=subprocess.DEVNULL,
            stderr=writer,
            start_new_session=True,
            preexec_fn=lambda: _in_front_of(messages),
        )
        os.close(writer)

    def send(self, number: int) -> None:
        """Send a signal to the process that was started."""
        self.process.send_signal(number)

    def send_all(self, number: int) -> None:
        """Send a signal to it and its workers, as a terminal does."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, number)

    def workers(self) -> list[int]:
        """Its worker processes."""
        try:
            children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
            lines = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children.split()}
        except OSError:
            return []
        return [pid for pid, line in lines.items() if b"resource_tracker" not in line]

    def has_begun(self) -> bool:
        """Whether it handles the signals by now: what comes before that, Python or the system answers."""
        try:
            status = Path(f"/proc/{self.process.pid}/status").read_text()
        except OSError:
            return True
        caught = int(status.partition("SigCgt:")[2].split()[0], 16)
        return bool(caught >> (signal.SIGTERM - 1) & 1)

    def goes_on(self, images: int) -> bool:
        """Wait until it has made so many images more than were there; whether it still runs then."""
        while self.process.poll() is None and self._images() < images:
            time.sleep(0.002)
        return self.process.poll() is None

    def _images(self) -> int:
        made = Path(self.folder / IMAGES[1]).glob("*.png")
        with contextlib.suppress(OSError):  # one was replaced
            return sum(each.stat().st_mtime_ns > self._began for each in made)
        return 0

    def leave(self) -> None:
        """Close the end where its messages are read."""
        if self.reader >= 0:
            os.close(self.reader)
            self.reader = -1

    def end(self) -> tuple[int, str]:
        """Wait for its end; its status and what it said, as far as that is known."""
        status = self.process.wait(LONGEST_S)
        said = b""
        if self.reader >= 0:
            os.set_blocking(self.reader, False)
            try:
                while data := os.read(self.reader, 1 << 16):
                    said += data
            except OSError:  # nothing more, or the terminal is gone
                pass
            self.leave()
        elif self._said.exists():
            said = self._said.read_bytes()
        return status, said.decode("utf-8", "replace")

    def left(self) -> list[str]:
        """Its processes that are still there when they should long have gone."""
        give_up = time.monotonic() + 30
        while time.monotonic() < give_up:
            try:
                os.killpg(self.process.pid, 0)
            except ProcessLookupError:
                return []
            time.sleep(0.01)
        return subprocess.run(
            ["ps", "-o", "pid=,stat=,args=", "-g", str(self.process.pid)], capture_output=True, text=True
        ).stdout.splitlines()


def storm(run: Run, chance: random.Random) -> None:
    """Signals that stop, halt and wake, one upon the other, to one process or to all."""
    for _ in range(chance.randint(5, 60)):
        send = chance.choice((run.send, run.send_all))
        send(chance.choice((*STOPS, *STOPS, signal.SIGSTOP, signal.SIGCONT)))
        time.sleep(chance.choice((0, 0, 0.001, 0.01)))
    with contextlib.suppress(ProcessLookupError):  # whatever is left of it
        os.killpg(run.process.pid, signal.SIGCONT)


def halt(run: Run, chance: random.Random) -> None:
    """Stop all of it for a while, as Ctrl-Z and fg do."""
    run.send_all(signal.SIGSTOP)
    time.sleep(chance.uniform(0, 0.3))
    run.send_all(signal.SIGCONT)


def second_run(run: Run, chance: random.Random) -> str:
    """Stop it, and start a second run on its result, which has to be refused once the first one holds it."""
    run.send_all(signal.SIGSTOP)
    held = f" {run.process.pid} " in Path("/proc/locks").read_text()
    second = Run(run.folder, run.result, run.jobs, run.task, "pipe") if held else None
    status, said = second.end() if second else (2, "another run")
    run.send_all(signal.SIGCONT)
    return "" if status == 2 and "another run" in said else f"a second run ended with {status}: {said[-300:]}"


def a_worker(number: int) -> Callable[[Run, random.Random], None]:
    """Send the signal to one of its workers; one that was stopped is woken after a while."""

    def act(run: Run, chance: random.Random) -> None:
        for worker in run.workers()[: chance.randint(1, 2)][-1:]:
            os.kill(worker, number)
            if number == signal.SIGSTOP:
                time.sleep(chance.uniform(0, 0.3))
                os.kill(worker, signal.SIGCONT)

    return act


class Kind(NamedTuple):
    """A way to disturb a run; `ends`: the run is over then, with one of these statuses or with 0."""

    act: Callable[[Run, random.Random], str | None]
    ends: bool = True
    statuses: tuple[int, ...] = (130,)
    jobs: tuple[int, ...] = (1, 2)
    messages: str = "file"


KINDS = {
    "kill": Kind(lambda run, _: run.send(signal.SIGKILL), statuses=(-9,)),
    "kill-all": Kind(lambda run, _: run.send_all(signal.SIGKILL), statuses=(-9,)),
    "kill-worker": Kind(a_worker(signal.SIGKILL), ends=False, jobs=(2,)),
    "ctrl-c": Kind(lambda run, _: run.send_all(signal.SIGINT)),
    "sigterm": Kind(lambda run, _: run.send(signal.SIGTERM)),
    "sighup": Kind(lambda run, _: run.send_all(signal.SIGHUP)),
    "storm": Kind(storm),
    "stop": Kind(halt, ends=False),
    "stop-worker": Kind(a_worker(signal.SIGSTOP), ends=False, jobs=(2,)),
    "second-run": Kind(second_run, ends=False),
    "closed-terminal": Kind(lambda run, _: run.leave(), messages="terminal"),
    "closed-pipe": Kind(lambda run, _: run.leave(), ends=False, messages="pipe"),
}


def disturbed(folder: Path, result: str, jobs: int, task: Task, name: str, chance: random.Random):
    """Disturb one run; whether it met it alive, and early, whether the work is done, and what was found."""
    kind = KINDS[name]
    run = Run(folder, result, jobs, task, kind.messages)
    if chance.random() < STARTING:
        time.sleep(chance.uniform(0, START_S))
    elif run.goes_on(chance.randint(0, MOST_IMAGES)):
        time.sleep(chance.uniform(0, FRAME_S))
    early, met = not run.has_begun(), run.process.poll() is None
    found = kind.act(run, chance) if met else None
    try:
        status, said = run.end()
    except subprocess.TimeoutExpired:
        run.send_all(signal.SIGKILL)
        return met, early, False, f"hangs, {found}"
    allowed = kind.statuses if met and kind.ends else ()
    by_python = early and (
        status in _BY_SIGNAL or ("KeyboardInterrupt" in said and str(ROOT / "rollcli") not in said)
    )
    if not by_python and ("Traceback" in said or "internal error" in said):
        found = said[-2000:]
    if not by_python and status not in (0, *allowed):
        found = f"status {status}: {said[-500:]}"
    if left := run.left():
        found = f"outlive their run: {left}"
    return met, early, status == 0, found


def make_tasks(folder: Path, frames: int) -> list[Task]:
    """Make what the tasks read."""
    write_maps(folder / "maps", frames)
    tasks = [Task("../maps"), Task("../grown", "--update", folder / "earlier")]
    write_maps(folder / "grown", frames)
    (folder / "earlier").mkdir()
    for result in RESULTS:
        line = ("estimate", "../grown", "-o", result, *IMAGES, "--overwrite")
        assert rollcli(*line, cwd=folder / "earlier").status == 0
    for number in range(0, frames, 3):
        write_kitti(folder / "grown" / f"frame{number}.png", road_map(0.2, seed=1000 + number))
    for number in range(1, frames, 4):
        write_kitti(folder / "grown" / f"frame{number}a.png", road_map(0.1, seed=2000 + number))
    for number in range(2, frames, 6):
        (folder / "grown" / f"frame{number}.png").unlink()
    if find_spec("rosbags") is None:
        print("without bags: the extra bags is not here")
        return tasks
    from tests.files.recordings.bag_files import disparity_image, write_bag

    def messages(store):
        for number in range(frames):
            values = road_map(0.01 * (number % 40), seed=number)
            yield "/disparity", number, disparity_image(store, values, number + 1)

    write_bag(folder, "run", "mcap", messages)
    return [*tasks, Task("../run.mcap")]


def main() -> None:
    """Print a line for each finding and each ten trials, and how often each kind met a run."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    chance, kinds = random.Random(given.seed), given.kinds or list(KINDS)
    counts: Counter[str] = Counter()
    trials, same, findings, early_ones = 0, 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tasks, expected = make_tasks(folder, given.frames), {}
        pairs = [(tasks[0], IN_PARTS), *itertools.product(tasks, RESULTS)]
        for number, (task, result) in enumerate(pairs):
            undisturbed = folder / f"undisturbed{number}"
            undisturbed.mkdir()
            Run(undisturbed, result, 2, task._replace(flag="--overwrite")).end()
            before = contents(task.before) if task.before else {}
            expected[task, result] = before | contents(undisturbed)
        while counts.total() < given.count:
            (task, result), jobs = pairs[trials // 2 % len(pairs)], 1 + trials % 2
            trial = folder / f"trial{trials}"
            if task.before:
                shutil.copytree(task.before, trial)
            else:
                trial.mkdir()
            done = False
            while not done:
                kind = chance.choice([each for each in kinds if jobs in KINDS[each].jobs])
                met, early, done, found = disturbed(trial, result, jobs, task, kind, chance)
                counts[kind] += met
                early_ones += met and early
                if found:
                    findings += 1
                    print(f"FOUND by {kind}, -j{jobs}, {result}, {task.inputs}: {found}", flush=True)
            trials += 1
            if contents(trial) == expected[task, result]:
                same += 1
                shutil.rmtree(trial)
            else:
                print(f"DIFFERENT bytes, -j{jobs}, {result}, {task.inputs}, after {kind}", flush=True)
            if trials % 10 == 0:
                said = ", ".join(f"{kind} {counts[kind]}" for kind in kinds)
                print(f"{counts.total()} ({said}); {same} of {trials} trials the same", flush=True)
    for kind in kinds:
        print(f"{kind:16} {counts[kind]}")
    print(
        f"{counts.total()} disturbances, {early_ones} before the program had begun; {findings} findings; "
        f"{same} of {trials} trials ended in the bytes of an undisturbed run"
    )


if __name__ == "__main__":
    main()
