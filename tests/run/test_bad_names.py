"""Inputs that the system refuses to look at: each costs its row, never the batch."""

import errno
import os
import shutil
from functools import partial

import pytest

from tests.run_cli import command, ended, rollcli, rollcli_process, rows_of, write_maps

LONG = "x" * 300 + ".png"


FRAMES = 3


def statuses(folder):
    return [row["status"] for row in rows_of((folder / "rolls.csv").read_text())]


def run_failing(folder, monkeypatch, calls, *arguments):
    """Run the program where some calls fail for one of the maps, as of a dying disk or a lost server."""

    def failing(call, path, *args, **options):
        if not isinstance(path, int) and os.fspath(path).endswith("frame1.png"):
            raise OSError(errno.EIO, os.strerror(errno.EIO), path)
        return call(path, *args, **options)

    with monkeypatch.context() as patch:
        for name in calls:
            patch.setattr(os, name, partial(failing, getattr(os, name)))
        return rollcli(*arguments, cwd=folder)


@pytest.mark.parametrize("name", [LONG, f"{LONG}/{LONG}", f"maps/{LONG}"])
def test_a_name_that_no_file_system_takes_costs_its_row(maps, name):
    done = rollcli("estimate", "maps", name, "-o", "rolls.csv", "--derotated", "up", cwd=maps, status=3)
    assert sorted(statuses(maps)) == ["error", "ok", "ok", "ok"]
    assert "file name too long" in done.err
    assert rollcli("derotate", "maps", name, "--roll", "1", "-o", "turned", cwd=maps).status == 3
    assert len(list((maps / "turned").iterdir())) == 3


def without_privilege():
    """What stands before a command so that permissions count, for root too."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        return []
    if shutil.which("setpriv") is None:
        pytest.skip("root may read everything, and there is no setpriv to give that up")
    return ["setpriv", "--bounding-set=-dac_override,-dac_read_search"]


@pytest.mark.parametrize(
    ("line", "mode", "status", "said"),
    [
        (
            "estimate maps/frame0.png shut/frame0.png -o rolls.csv",
            0,
            3,
            "shut/frame0.png: cannot be read",
        ),
        ("estimate . --recursive", 0, 2, "shut: this folder cannot be read"),
        ("derotate maps/frame1.png --roll 1 -o shut", 0o500, 1, "shut/frame1.png: cannot be written"),
    ],
)
def test_a_folder_that_may_not_be_entered_read_or_written_is_named(maps, line, mode, status, said):
    write_maps(maps / "shut", 1)
    (maps / "shut").chmod(mode)
    done = ended([*without_privilege(), *command(*line.split())], maps)
    (maps / "shut").chmod(0o700)
    assert done.returncode == status, done.stderr
    assert f"{said}: permission denied" in done.stderr
    if status == 3:
        assert statuses(maps) == ["ok", "error"]


def test_a_file_that_cannot_be_read_for_a_dying_disk_costs_its_row(maps, monkeypatch):
    arguments = ("estimate", "maps", "-o", "rolls.csv", "-j1")
    done = run_failing(maps, monkeypatch, ["stat", "lstat", "open"], *arguments)
    assert done.status == 3, done.err
    assert statuses(maps) == ["ok", "error", "ok"]
    assert "frame1.png: cannot be read: input/output error" in done.err


def test_a_passing_fault_while_inputs_are_looked_at_does_not_hinder_a_resume(maps, monkeypatch):
    arguments = ("estimate", "maps", "-o", "rolls.csv", "-j1")
    assert run_failing(maps, monkeypatch, ["stat"], *arguments).status == 0
    whole = (maps / "rolls.csv").read_bytes()
    (maps / "rolls.csv").write_bytes(whole[: whole.index(b"maps/frame1")])
    done = rollcli(*arguments, "--resume", cwd=maps)
    assert (done.status, (maps / "rolls.csv").read_bytes()) == (0, whole), done.err
    (maps / "rolls.csv").write_bytes(whole[: whole.index(b"maps/frame1")])
    shutil.copyfile(maps / "maps" / "frame1.png", maps / "maps" / "frame0.png")
    assert rollcli(*arguments, "--resume", cwd=maps).status == 2


@pytest.mark.parametrize("length", [248, 253, 255])
def test_a_result_whose_name_is_too_long_for_its_record_is_one_line(maps, length):
    name = "r" * (length - 4) + ".csv"
    done = rollcli_process("estimate", "maps", "-o", name, cwd=maps)
    assert (done.status, done.err.count("\n")) == (1, 1)
    assert "file name too long" in done.err
