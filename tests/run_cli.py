"""The program as a user runs it, and maps for it to read."""

import contextlib
import csv
import importlib.util
import io
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.in_process import Finished, run_here

ROOT = Path(__file__).resolve().parent.parent
_WITH_WORKERS = (
    *("estimate", "disparity", "derotate", "vdisparity", "heights", "simulate", "report"),
    "evaluate_accuracy",
)
_ONE_WORKER = {f"ROLLCLI_{name.upper()}_JOBS": "1" for name in _WITH_WORKERS}
# processes compile the program once, not each of them anew
_NOT_KEPT = ("ROLLCLI", "PYTHONDONTWRITEBYTECODE")
_STARTS_PROCESSES = re.compile(r" (-j|--jobs)(?![ =]?1 )| --scheduler")


def command(*arguments: str | Path) -> list[str]:
    """The command line of the program under test."""
    return [sys.executable, "-m", "rollcli", *map(str, arguments)]


def environment(**variables: str) -> dict[str, str]:
    """This environment without settings of rollcli's, with these; one process where no more are asked for."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_NOT_KEPT)}
    path = os.pathsep.join(filter(None, [str(ROOT), kept.get("PYTHONPATH")]))
    return {**kept, "PYTHONPATH": path, **_ONE_WORKER, **variables}


def rollcli(
    *arguments: str | Path, cwd: Path, stdin: str = "", status: int | None = None, **variables: str
) -> Finished:
    """Run the program to its end: in this process, unless it starts others or is told how Python starts.

    Where an exit status is given, another one is a failure, which shows what the program said.

    With a URL it has one frame in hand here; in a process of its own, a worker has several.
    """
    words = [*map(str, arguments)]
    starts_others = _STARTS_PROCESSES.search(f" {' '.join(words)} ") and "--dry-run" not in words
    if starts_others or "PYTHONPATH" in variables:
        done = rollcli_process(*words, cwd=cwd, stdin=stdin, **variables)
    else:
        done = run_here(words, cwd, stdin, environment(**variables))
    if "Parquet needs the extra parquet" in done.err and importlib.util.find_spec("pyarrow") is None:
        pytest.skip("pyarrow, of the extra parquet, is not here")
    assert status in (None, done.status), (done.status, done.err)
    return done


def rollcli_process(*arguments: str | Path, cwd: Path, stdin: str = "", **variables: str) -> Finished:
    """Run the program to its end in a process of its own; a traceback is always a failure."""
    how = {"input": stdin, "env": environment(**variables), "errors": "surrogateescape", "timeout": 120}
    done = ended(command(*arguments), cwd, **how)
    assert "Traceback" not in done.stderr, done.stderr
    return Finished(done.returncode, done.stdout, done.stderr)


def ended(line: list[str | Path], cwd: Path, **how: Any) -> subprocess.CompletedProcess[Any]:
    """Run a command line to its end, whatever its status; what it says can be read."""
    pipe = subprocess.PIPE
    how = {"env": environment(), "stdout": pipe, "stderr": pipe, "text": True, "check": False} | how
    return subprocess.run(line, cwd=cwd, **how)


def python(
    code: str, *arguments: str | Path, cwd: Path | None = None, **how: Any
) -> subprocess.CompletedProcess[Any]:
    """Run some Python in a process of its own."""
    return ended([sys.executable, "-c", code, *map(str, arguments)], cwd, **how)


def started(*arguments: str | Path, cwd: Path, **how: Any) -> "subprocess.Popen[str]":
    """Start the program and go on; what it says on standard error can be read."""
    how = {"env": environment(), "stderr": subprocess.PIPE, "text": True} | how
    return subprocess.Popen(command(*arguments), cwd=cwd, **how)


# a worker that reads a certain map says so, and comes back from it when it may
_HELD = """
import multiprocessing, pathlib, time
import rollcli.files.formats as formats
read = formats.read_stored
def read_stored(path, name=None, **how):
    if pathlib.Path(path).stem == "STEM" and multiprocessing.parent_process():
        pathlib.Path("has-begun").touch()
        while not pathlib.Path("may-go-on").exists():
            time.sleep(0.01)
    return read(path, name, **how)
formats.read_stored = read_stored
"""


def holding(folder: Path, stem: str) -> dict[str, str]:
    """The environment in which workers hold the map of this stem, from `has-begun` to `may-go-on`."""
    return hooked(folder, _HELD.replace("STEM", stem))


def hooked(folder: Path, code: str) -> dict[str, str]:
    """The environment in which every process runs some code as it starts, as Python's `sitecustomize`."""
    hook = folder / "hook"
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(code)
    # NumPy loads before the program can limit its threads
    return environment(PYTHONPATH=os.pathsep.join([str(hook), str(ROOT)]), OPENBLAS_NUM_THREADS="1")


_HALF = """
import os, sys
from rollcli.files.atomic import atomic_file
with atomic_file(sys.argv[1]) as file:
    file.write(b"half of a file")
    file.flush()
    os._exit(9)
"""


def leave_half(path: Path) -> None:
    """Leave what a process leaves that is killed while it writes this file."""
    subprocess.run([sys.executable, "-c", _HALF, path], check=False)


def error_of(kind: type[Exception], call: Callable[..., Any], *arguments: Any) -> str:
    """What the error of this kind says that a call must end with."""
    with pytest.raises(kind) as caught:
        call(*arguments)
    return str(caught.value)


def interrupt_in(patch: Any, module: Any, name: str) -> None:
    """Send this process a Ctrl-C before each call of a module's function, which is then done all the same."""
    work = getattr(module, name)

    def interrupted(*arguments: Any, **options: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return work(*arguments, **options)

    patch.setattr(module, name, interrupted)


def write_program(folder: Path) -> None:
    """Put the program where a shell that looks into `bin` finds it."""
    (folder / "bin").mkdir()
    program = folder / "bin" / "rollcli"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rollcli "$@"\n')
    program.chmod(0o755)


def wait_until(condition: Callable[[], object], run: "subprocess.Popen[Any] | None" = None) -> None:
    """Wait for what another process brings about, or for the end of a run; fail after a minute."""
    give_up = time.monotonic() + 60
    while not condition() and (run is None or run.poll() is None):
        assert time.monotonic() < give_up
        time.sleep(0.002)


def wait_for_files(folder: Path, pattern: str, count: int, run: "subprocess.Popen[Any]") -> None:
    """Wait until so many whole files are there."""
    wait_until(lambda: len(list(folder.glob(pattern))) >= count, run)


def keep_rows(path: Path, count: int, further: int = 0) -> bytes:
    """Cut a result behind its header and some rows, or bytes of a further one; return what it was."""
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    path.write_bytes(b"".join(lines[: count + 1]) + b"".join(lines[count + 1 :])[:further])
    return whole


def contents(folder: Path, without: str | tuple[str, ...] = ()) -> dict[str, bytes]:
    """Every file below a folder, by its relative path, but those whose paths begin like this."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if not name.startswith(without)}


@contextlib.contextmanager
def folder_of(names: Iterable[str]) -> Iterator[None]:
    """Work in a folder that has these files, some of them links to others, and nothing else."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for name, _, target in (each.partition("->") for each in names):
                Path(name).parent.mkdir(parents=True, exist_ok=True)
                Path(name).symlink_to(target) if target else Path(name).write_bytes(b"x")
            yield
        finally:
            os.chdir(before)


def rows_of(text: str) -> list[dict[str, str]]:
    """The rows of a CSV, by its header."""
    return list(csv.DictReader(io.StringIO(text)))


def road_map(roll: float = 0.0, *, width: int = 160, height: int = 120, noise: float = 0.05, seed: int = 0):
    """Disparity (px) of a flat road that fills the map, rolled by `roll` radians."""
    v, u = np.mgrid[:height, :width]
    y = v * np.cos(roll) - u * np.sin(roll)
    clean = 20 + 0.3 * (y - y.min())
    return (clean + np.random.default_rng(seed).normal(0, noise, clean.shape)).astype(np.float32)


def write_kitti(path: Path, disparity) -> None:
    """A map as a 16-bit KITTI PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(".png", np.rint(disparity * 256).astype(np.uint16))[1])


def write_maps(folder: Path, count: int, **size: int) -> None:
    """`count` maps frame0.png, frame1.png, ..., each rolled a little more."""
    for index in range(count):
        write_kitti(folder / f"frame{index}.png", road_map(0.01 * (index % 40), seed=index, **size))


def estimated(
    folder: Path, count: int, *arguments: str, broken: Mapping[int, bytes] | None = None, **size: int
) -> Path:
    """A folder of maps, of which some have other bytes, and what `estimate` has made of them, rolls.csv."""
    write_maps(folder / "maps", count, **size)
    for index, data in (broken or {}).items():
        (folder / "maps" / f"frame{index}.png").write_bytes(data)
    rollcli("estimate", "maps", "-o", "rolls.csv", *arguments, cwd=folder, status=3 if broken else 0)
    return folder


def write_pair(folder: Path, name: str, disparity, seed: int = 0):
    """A textured stereo pair with this disparity (px), folder/left/name and folder/right/name; its views."""
    height, width = disparity.shape
    texture = np.random.default_rng(seed).uniform(0, 255, (height, width + 64)).astype(np.float32)
    texture = cv2.GaussianBlur(texture, (0, 0), 1.0)
    at = np.arange(32, 32 + width, dtype=np.float32) - disparity.astype(np.float32)
    first = np.floor(at).astype(int)
    # versions of OpenCV differ in what is between pixels; beyond the border the texture is mirrored
    one, other = (
        np.take_along_axis(texture, np.where(each < 0, -1 - each, each), 1) for each in (first, first + 1)
    )
    seen = one + (at - first) * (other - one)
    views = seen.astype(np.uint8), texture[:, 32 : 32 + width].astype(np.uint8)
    write_views(folder, name, *views)
    return views


def write_views(folder: Path, name: str, *views) -> None:
    """The views of a pair as folder/left/name and folder/right/name, PNG."""
    for side, view in zip(("left", "right"), views, strict=True):
        (folder / side).mkdir(parents=True, exist_ok=True)
        (folder / side / name).write_bytes(cv2.imencode(".png", view)[1])
