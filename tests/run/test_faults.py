"""Full disks, lost files, dead workers, closed pipes: the documented status, one line, and nothing lost."""

import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pytest

from rollcli.files.results import parse_rows
from rollcli.run.frame import Frame
from rollcli.run.frame_task import run_frame
from rollcli.run.options import FramesOptions
from tests.run_cli import (
    ROOT,
    command,
    contents,
    ended,
    environment,
    holding,
    hooked,
    rollcli,
    started,
    wait_until,
    write_maps,
)

pytestmark = pytest.mark.slow

FRAMES = 12


def one_line(done):
    """The only line of an error."""
    assert done.err.count("\n") == 1
    return done.err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_full_device_ends_the_run_with_status_1(maps, jobs):
    done = rollcli("estimate", "maps", "-o", "/dev/full", "-q", "-j", jobs, cwd=maps, status=1)
    assert "/dev/full: cannot be written: no space left on device" in one_line(done)


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_result_that_may_not_grow_keeps_its_whole_rows_and_is_resumed_later(maps, jobs):
    write_maps(maps / "maps", 40)
    arguments = ("estimate", "maps", "-o", "rolls.csv", "-q", "-j", jobs)
    rollcli("estimate", "maps", "-o", "whole.csv", "-q", cwd=maps)
    whole = (maps / "whole.csv").read_bytes()
    limited = ended(
        command(*arguments),
        maps,
        env=environment(PYTHONDONTWRITEBYTECODE="1"),  # it would keep the first 4,000 bytes of each module
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000)),
    )
    assert limited.returncode == 1
    assert "rolls.csv" in limited.stderr
    assert limited.stderr.count("\n") == 1
    kept = (maps / "rolls.csv").read_bytes()
    assert whole.startswith(kept)
    assert kept.endswith(b"\n")
    assert rollcli(*arguments, "--resume", cwd=maps).status == 0
    assert (maps / "rolls.csv").read_bytes() == whole


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_full_disk_of_images_keeps_the_rows_before_it(maps, jobs):
    disk = maps / "disk"
    disk.mkdir()
    if ended(["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", disk], maps).returncode:
        pytest.skip("a small file system cannot be mounted here")
    try:
        arguments = ("estimate", "maps", "-o", "rolls.csv", "-q", "-j", jobs, "--derotated", "disk/upright")
        done = rollcli(*arguments, cwd=maps, status=1)
        assert "no space left" in one_line(done)
        rows = (maps / "rolls.csv").read_text().splitlines()[1:]
        # of two workers, the second may fill the disk before the first has an image to write
        assert jobs == "2" or rows
        assert len(rows) < FRAMES
        for row in rows:
            name = row.split(",")[0].removeprefix("maps/")
            assert (disk / "upright" / name).stat().st_size > 0
        subprocess.run(["mount", "-o", "remount,size=8m", disk], check=True)
        assert rollcli(*arguments, "--resume", cwd=maps).status == 0
        assert len((maps / "rolls.csv").read_text().splitlines()) == 1 + FRAMES
        assert len(contents(disk)) == FRAMES
    finally:
        subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize(("jobs", "moved"), [("1", True), ("2", False)])
def test_a_result_that_is_moved_or_removed_while_running_ends_the_run_with_status_1(maps, jobs, moved):
    write_maps(maps / "maps", 300)
    run = started("estimate", "maps", "-o", "rolls.csv", "-q", "-j", jobs, cwd=maps)
    result = maps / "rolls.csv"
    wait_until(lambda: result.exists() and result.stat().st_size > 2000)
    if moved:
        result.rename(maps / "moved.csv")
    else:
        result.unlink()
    _, err = run.communicate(timeout=60)
    assert run.returncode == 1
    assert err == "rollcli: rolls.csv: was moved or removed while this run was writing it\n"
    assert not result.exists()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_closed_pipe_ends_the_run_quietly(maps, jobs):
    run = started("estimate", "maps", "-j", jobs, "-q", cwd=maps, stdout=subprocess.PIPE)
    run.stdout.readline()
    run.stdout.close()
    err = run.stderr.read()
    run.stderr.close()
    assert run.wait(60) == 0
    assert err == ""


@pytest.mark.parametrize("words", [("estimate", "maps", "-q"), ("simulate", "out", "--dry-run")])
def test_a_closed_standard_output_is_an_error_in_one_line(maps, words):
    done = ended(["sh", "-c", " ".join(command(*words)) + " >&-"], maps)
    assert (done.returncode, done.stderr) == (1, "rollcli: standard output: is closed\n")


def test_what_is_printed_where_all_streams_are_closed_is_in_no_result(maps):
    closed = ["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", *command("estimate", "maps", "-o", "rolls.csv")]
    ended(closed, maps, env=environment(PYTHONPROFILEIMPORTTIME="1"))
    assert len((maps / "rolls.csv.inputs").read_bytes()) == 51 * FRAMES


# in a worker, reading certain maps kills it
DEADLY_MAPS = """
import multiprocessing, os, pathlib, signal
import rollcli.files.formats as formats
read = formats.read_stored
def read_stored(path, name=None, **how):
    stem = pathlib.Path(path).stem
    deaths = list(pathlib.Path(".").glob(f"died-of-{stem}-*"))
    if stem in DEADLY and len(deaths) < TIMES and multiprocessing.parent_process():
        pathlib.Path(f"died-of-{stem}-{os.getpid()}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return read(path, name, **how)
formats.read_stored = read_stored
"""
ESTIMATE = ("estimate", "maps", "-j2", "-o", "rolls.csv", "-q")


def run_with_deaths(maps, deadly, times, arguments=ESTIMATE):
    """A run in which reading certain frames kills the worker, so many times each."""
    hook = f"DEADLY, TIMES = {deadly!r}, {times}\n{DEADLY_MAPS}"
    return rollcli(*arguments, cwd=maps, **hooked(maps, hook))


def test_a_worker_that_dies_once_costs_nothing(maps):
    rollcli("estimate", "maps", "-o", "undisturbed.csv", "-q", cwd=maps)
    assert run_with_deaths(maps, ["frame3", "frame8"], 1).status == 0
    assert len(list(maps.glob("died-of-*"))) == 2
    assert (maps / "rolls.csv").read_bytes() == (maps / "undisturbed.csv").read_bytes()


def test_a_frame_that_kills_its_worker_twice_is_an_error_row_and_the_batch_goes_on(maps):
    assert run_with_deaths(maps, ["frame3"], 99).status == 3
    deaths = len(list(maps.glob("died-of-*")))
    assert 2 <= deaths <= 2 + math.ceil(math.log2(FRAMES))  # its chunk is halved until it is alone
    rows = list(parse_rows((maps / "rolls.csv").read_bytes(), "rolls.csv"))
    assert len(rows) == FRAMES
    assert [(row.file, row.message) for row in rows if row.status == "error"] == [
        ("maps/frame3.png", "its worker died twice: killed for memory, perhaps, or crashed")
    ]


def test_a_map_that_kills_its_worker_twice_is_not_derotated_and_the_others_are(maps):
    (maps / "out").mkdir()
    (maps / "out" / "frame3.png").write_text("of an earlier run")
    line = ("derotate", "maps", "-j2", "--roll", "2", "-o", "out", "--overwrite")
    done = run_with_deaths(maps, ["frame3"], 99, line)
    assert done.status == 3
    assert "maps/frame3.png: its worker died twice: killed for memory, perhaps, or crashed" in done.err
    assert sorted(contents(maps / "out")) == sorted(f"frame{n}.png" for n in range(FRAMES) if n != 3)


# the first worker that gives an image of a certain frame its name dies just before or after it
DEADLY_NAMES = """
import multiprocessing, os, pathlib, signal
def deadly(give_name):
    def give(source, target, **options):
        in_worker = FRAME in str(target) and multiprocessing.parent_process()
        first = in_worker and not pathlib.Path("died").exists()
        if first:
            pathlib.Path("died").touch()
        if not first or AFTER:
            give_name(source, target, **options)
        if first:
            os.kill(os.getpid(), signal.SIGKILL)
    return give
os.link, os.replace, os.rename = map(deadly, (os.link, os.replace, os.rename))
if hasattr(pathlib, "_NormalAccessor"):  # Python 3.10 keeps what pathlib finds there
    pathlib._NormalAccessor.replace = staticmethod(os.replace)
"""
WRITE_IMAGES = {
    "estimate": ("frame3", "estimate maps -o out/rolls.csv --derotated out/up --vdisparity out/v"),
    "derotate": ("frame3", "derotate maps --roll 2 -o out"),
    "simulate": ("frame_0002", "simulate out --frames 3 --size 64x48"),
}


@pytest.mark.parametrize(("name", "after"), [*((each, False) for each in WRITE_IMAGES), ("estimate", True)])
def test_a_worker_that_dies_while_it_writes_an_image_leaves_nothing_behind(maps, name, after):
    frame, line = WRITE_IMAGES[name]
    (maps / "out").mkdir()
    assert rollcli(*line.split(), "-j1", cwd=maps).status == 0
    expected = contents(maps / "out")
    shutil.rmtree(maps / "out")
    (maps / "out").mkdir()
    hook = f"FRAME, AFTER = {frame!r}, {after}\n{DEADLY_NAMES}"

    rollcli(*line.split(), "-j2", cwd=maps, **hooked(maps, hook), status=0)

    assert (maps / "died").exists()
    assert contents(maps / "out") == expected


def cannot_start(maps, jobs="2", **how):
    """The one line of a run whose workers cannot start."""
    done = ended(command(*ESTIMATE, "-j", jobs), maps, **how)
    assert done.returncode == 1
    assert done.stderr.startswith("rollcli: a worker process cannot start: ")
    assert done.stderr.endswith("; try fewer of them, with --jobs\n")
    assert done.stderr.count("\n") == 1
    result = maps / "rolls.csv"  # no frame has to answer for it
    assert not result.exists() or result.read_bytes().count(b"\n") == 1
    return done.stderr


def test_too_few_open_files_for_workers_end_the_run_in_one_line(maps):
    limit = partial(resource.setrlimit, resource.RLIMIT_NOFILE, (24, 24))
    assert "Too many open files" in cannot_start(maps, jobs="12", preexec_fn=limit)


@pytest.mark.parametrize("error", [ImportError("no NumPy"), OSError("no library"), MemoryError("no memory")])
def test_a_worker_that_cannot_load_its_libraries_ends_the_run_in_one_line(maps, error):
    finder = f"class Finder:\n def find_spec(name, *_):\n  if name == 'cv2': raise {error!r}\n"
    hook = f"import sys\n{finder}sys.meta_path.insert(0, Finder)\n"
    assert f": {error};" in cannot_start(maps, env=hooked(maps, hook))


def test_workers_end_with_a_run_that_is_killed_also_in_the_middle_of_a_frame(maps):
    how = {"env": holding(maps, "frame8"), "stderr": None, "start_new_session": True}
    run = started(*ESTIMATE, cwd=maps, **how)
    wait_until((maps / "has-begun").exists)
    run.kill()
    run.wait()
    wait_until(lambda: not alive_in_group(run.pid))


def alive_in_group(group):
    try:
        os.killpg(group, signal.SIGCONT)
    except ProcessLookupError:
        return False
    return True


def test_the_row_of_a_frame_without_memory_says_so(monkeypatch):
    monkeypatch.setattr("rollcli.run.frame_task.read_source", Mock(side_effect=MemoryError))
    row = run_frame(Frame("a.png", "", "a.png", "", "a.png", None), FramesOptions()).row
    assert (row.status, row.message) == ("error", "out of memory")


def test_a_run_with_a_call_that_fails_is_resumed_to_the_same_bytes():
    # in a process of its own: a fork of this one would lack the threads that OpenCV may have started here
    line = [sys.executable, "-m", "tests.fuzz.faults", "40"]
    done = ended(line, ROOT, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    (tried,) = re.findall(r"^(\d+) faults, 0 finds$", done.stdout, flags=re.M)
    assert int(tried) >= 5
    of_rows, of_parts = re.findall(r"^rolls\.\w+: calls: (.*)$", done.stdout, flags=re.M)
    both = {"open", "write", "close", "replace", "stat", "mkdir"}
    assert both | {"flock"} <= set(of_rows.split())
    assert both | {"scandir"} <= set(of_parts.split())
