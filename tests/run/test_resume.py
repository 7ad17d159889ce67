"""What survives when a run is killed, interrupted or started twice."""

import os
import shlex
import signal
import time
from pathlib import Path

import pytest

from rollcli.files.results import parse_rows
from rollcli.run.result_file import whole_rows
from tests.run_cli import contents, ended, environment, estimated, rollcli, started, wait_until, write_program

FRAMES = 40
IMAGES = ("--derotated", "upright", "--vdisparity", "v")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A folder of maps with the result and images of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed")
    return estimated(folder, FRAMES, *IMAGES, broken={7: b"no map"}, width=300, height=200)


@pytest.fixture
def folder(undisturbed, tmp_path):
    """The same maps, and nothing else."""
    (tmp_path / "maps").symlink_to(undisturbed / "maps")
    return tmp_path


def results(folder):
    """Everything but the maps."""
    return contents(folder, without="maps/")


def start(folder, *arguments):
    """A run in a process group of its own, as a shell would start it."""
    return started(
        "estimate", "maps", "-o", "rolls.csv", *IMAGES, *arguments, cwd=folder, start_new_session=True
    )


def wait_for_rows(folder, count, run, name="rolls.csv"):
    """Until so many rows are there."""
    result = folder / name
    wait_until(lambda: result.exists() and result.read_bytes().count(b"\n") > count, run)


def wait_for_images(folder, count, run):
    """Until so many frames are done: rows with images follow theirs in groups, up to a second later."""
    wait_until(lambda: len(list(folder.glob("upright/*.png"))) >= count, run)


@pytest.mark.slow
def test_a_run_killed_again_and_again_ends_in_the_same_bytes_and_leaves_nothing_else(undisturbed, folder):
    for rows, jobs in ((0, "2"), (9, "1"), (21, "2")):
        run = start(folder, "-j", jobs, *(["--resume"] if rows else []))
        wait_for_rows(folder, rows, run)
        run.kill()
        run.communicate()
    rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--resume", cwd=folder, status=3)
    assert results(folder) == results(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_keeps_what_is_done_and_prints_the_command_that_resumes(undisturbed, folder, jobs):
    run = start(folder, "-j", str(jobs))
    wait_for_images(folder, 4, run)
    os.killpg(run.pid, signal.SIGINT)  # a terminal sends it to the workers as well
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "Traceback" not in err
    line = err.splitlines()[-1].partition("continue with: ")[2]
    assert line.startswith("rollcli estimate maps -o rolls.csv")
    assert rollcli(*shlex.split(line)[1:], cwd=folder).status == 3
    assert results(folder) == results(undisturbed)


@pytest.mark.slow
def test_the_command_that_resumes_can_be_pasted_whatever_its_words_are(undisturbed, tmp_path):
    write_program(tmp_path)
    folder = '-it\'s "mine"'
    (tmp_path / folder).symlink_to(undisturbed / "maps")
    (tmp_path / "a b.toml").write_text("overwrite = true\nseed = 3\n")
    path = os.pathsep.join([str(tmp_path / "bin"), os.environ["PATH"]])
    settings = {"ROLLCLI_ESTIMATE_INVALID": "5 6", "ROLLCLI_ESTIMATE_TIMING": "0"}
    run = started(
        *("estimate", "-o", "my rolls.csv", "--config", "a b.toml", "--", folder),
        cwd=tmp_path,
        env=environment(PATH=path, ROLLCLI_ESTIMATE_ROAD="all", **settings),
    )
    wait_for_rows(tmp_path, 4, run, "my rolls.csv")
    run.send_signal(signal.SIGINT)
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130
    line = err.splitlines()[-1].partition("continue with: ")[2]
    # what was set for one command is no longer there
    pasted = ended(["sh", "-c", line], tmp_path, env=environment(PATH=path))
    assert pasted.returncode == 3, pasted.stderr
    assert "kept" in pasted.stderr
    assert (tmp_path / "my rolls.csv").read_bytes().count(b"\n") == FRAMES + 1


def test_the_command_that_resumes_a_list_says_that_it_is_needed_again(undisturbed, tmp_path):
    maps = sorted(map(str, (undisturbed / "maps").iterdir()))
    with (tmp_path / "list").open("w") as names:
        names.write("\n".join(maps))
    with (tmp_path / "list").open() as names:
        run = started("estimate", "-", "-o", "rolls.csv", cwd=tmp_path, stdin=names)
    wait_for_rows(tmp_path, 4, run)
    run.send_signal(signal.SIGINT)
    _, err = run.communicate(timeout=60)
    assert err.endswith("--resume  # with the same list on stdin\n")


@pytest.mark.slow
def test_ctrl_c_again_and_again_ends_at_once_in_one_piece(undisturbed, folder):
    run = start(folder, "-j2")
    wait_for_images(folder, 4, run)
    err = interrupt_until_it_ends(run)
    assert "Traceback" not in err
    assert "interrupted; continue with: rollcli estimate maps" in err
    assert rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--resume", cwd=folder).status == 3
    assert results(folder) == results(undisturbed)


@pytest.mark.slow
def test_ctrl_c_twice_ends_a_run_whose_worker_has_been_stopped(folder):
    run = start(folder, "-j2")
    wait_for_images(folder, 4, run)
    stopped = workers_of(run)[0]
    os.kill(stopped, signal.SIGSTOP)
    interrupt_until_it_ends(run)
    assert run.returncode == 130
    with pytest.raises(ProcessLookupError):
        os.kill(stopped, 0)


def interrupt_until_it_ends(run):
    """Ctrl-C by someone without patience; what the run said."""
    give_up = time.monotonic() + 60
    while run.poll() is None:
        assert time.monotonic() < give_up
        run.send_signal(signal.SIGINT)
        time.sleep(0.005)
    return run.communicate()[1]


def workers_of(run):
    """The worker processes of a run, oldest first."""
    listed = ended(["ps", "-A", "-ww", "-o", "ppid=,pid=,args="], Path.cwd()).stdout
    found = [line.split(None, 2) for line in listed.splitlines()]
    children = {int(pid): args for parent, pid, args in found if int(parent) == run.pid}
    return [pid for pid, args in children.items() if "resource_tracker" not in args]


@pytest.mark.slow
def test_a_second_run_on_the_same_result_is_refused(folder, monkeypatch):
    monkeypatch.setattr("rollcli.files.locking._PATIENCE_S", 0.1)
    first = start(folder, "-j1")
    wait_for_images(folder, 1, first)
    first.send_signal(signal.SIGSTOP)
    for flag in ("--resume", "--overwrite"):
        done = rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, flag, cwd=folder, status=2)
        assert "another run" in done.err
    first.send_signal(signal.SIGCONT)
    first.communicate(timeout=60)
    assert first.returncode == 3


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
def test_a_result_cut_anywhere_is_resumed_to_the_same_bytes(tmp_path, ending):
    names = ['comma, "quote".png', "new\nline.png", "return\rhere.png", "umlaut ü.png", b"no text \xff.png"]
    (tmp_path / "maps").mkdir()
    for name in names:
        (tmp_path / "maps" / os.fsdecode(name)).write_bytes(b"no map")
    result = tmp_path / f"rolls.{ending}"
    assert rollcli("estimate", "maps", "-o", result.name, cwd=tmp_path).status == 3
    whole = result.read_bytes()
    rows = list(parse_rows(whole, "whole"))
    assert len(rows) == len(names)
    for end in range(len(whole) + 1):
        kept = whole_rows(whole[:end], ending)
        assert list(parse_rows(kept, "kept")) == rows[: kept.count(b"error")] if kept else end < len(whole)
    inputs = tmp_path / f"{result.name}.inputs"
    # the last as after a power cut: rows whose inputs were not yet on the disk may be anything
    for left in (whole[: whole.index(b"ne.png") - 1], whole[:-2], whole + b"\0\0\n"):
        result.write_bytes(left)
        inputs.write_bytes(inputs.read_bytes()[: -1 if len(left) > len(whole) else None])
        assert rollcli("estimate", "maps", "-o", result.name, "--resume", cwd=tmp_path).status == 3
        assert result.read_bytes() == whole


@pytest.mark.slow
def test_fail_fast_stops_at_the_first_failure_and_can_be_resumed(undisturbed, folder):
    done = rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--fail-fast", "-j2", cwd=folder)
    rows = (folder / "rolls.csv").read_text().splitlines()
    assert (done.status, len(rows)) == (3, 9)
    rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--resume", cwd=folder)
    assert results(folder) == results(undisturbed)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("kind", ["inputs", "run.json"])
def test_a_pipe_beside_a_result_is_not_waited_for(tmp_path, kind):
    pipe = estimated(tmp_path, 1) / f"rolls.csv.{kind}"
    pipe.unlink()
    os.mkfifo(pipe)
    done = rollcli("estimate", "maps", "-o", "rolls.csv", "-q", "--resume", "-j2", cwd=tmp_path)
    assert f"rolls.csv.{kind}" in done.refused()
