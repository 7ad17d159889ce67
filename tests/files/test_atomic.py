"""A file is there whole or not at all."""

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from rollcli.errors import OutputError
from rollcli.files.atomic import (
    NameTakenError,
    atomic_file,
    mark_path,
    remove_leftovers,
    sync_files,
    write_atomic,
)
from tests.run_cli import leave_half, python


def open_descriptors():
    return sum(1 for _ in Path("/dev/fd").iterdir())


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def refuses_links(error):
    """`os.link` on a disk that has none, as FAT's says it."""
    return Mock(side_effect=OSError(error, os.strerror(error)))


@pytest.mark.parametrize("error", [None, errno.EPERM, errno.EOPNOTSUPP])
def test_a_name_that_is_taken_is_left_alone_when_told_so(tmp_path, monkeypatch, error):
    if error is not None:
        monkeypatch.setattr(os, "link", refuses_links(error))
    write_atomic(tmp_path / "map.png", b"first", replaces=False)
    (tmp_path / "link.png").symlink_to("nothing")
    for name in ("map.png", "link.png"):
        with pytest.raises(NameTakenError):
            write_atomic(tmp_path / name, b"second", replaces=False)

    assert (tmp_path / "map.png").read_bytes() == b"first"
    assert (tmp_path / "link.png").is_symlink()
    assert names_in(tmp_path) == ["link.png", "map.png"]


def test_a_disk_that_fails_to_link_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "link", refuses_links(errno.EIO))
    with pytest.raises(OutputError, match=r"map\.png: cannot be written: input/output error"):
        write_atomic(tmp_path / "map.png", b"data", replaces=False)

    assert names_in(tmp_path) == []


LONG = ["x" * (length - 4) + ".png" for length in (225, 226, 255)]


@pytest.mark.parametrize("name", ["map.png", "é" * 120 + ".png", "a\nb.png", *LONG])
def test_what_a_killed_process_left_is_removed_before_the_next_run(tmp_path, name):
    for _ in range(2):
        leave_half(tmp_path / name)
    assert len(names_in(tmp_path)) == 2
    write_atomic(tmp_path / name, b"data")

    remove_leftovers([tmp_path / "other.png", tmp_path / name])

    assert names_in(tmp_path) == [name]


def test_what_others_have_named_alike_is_left_alone(tmp_path):
    strangers = [
        ".map.png.part",
        ".map.png.0123456789ABCDEF.part",
        ".map.png.0123456789abcde.part",
        "map.png.0123456789abcdef.part",
        ".other.png.0123456789abcdef.part",
        ".map.png.0123456789abcdef.part.txt",
    ]
    for name in strangers:
        (tmp_path / name).write_bytes(b"mine")
    (tmp_path / ".map.png.aaaaaaaaaaaaaaaa.part").mkdir()
    (tmp_path / ".map.png.bbbbbbbbbbbbbbbb.part").symlink_to(tmp_path / strangers[0])
    os.mkfifo(tmp_path / ".map.png.cccccccccccccccc.part")
    before = names_in(tmp_path)

    remove_leftovers([tmp_path / "map.png", tmp_path / "no such folder" / "map.png"])

    assert names_in(tmp_path) == before


@pytest.mark.parametrize("kind", ["link", "pipe"])
@pytest.mark.parametrize("guess", [".map.png.part", f".map.png.{'00' * 8}.part"])
def test_what_lies_at_a_guessed_temporary_name_is_neither_followed_nor_waited_for(
    tmp_path, monkeypatch, kind, guess
):
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    (tmp_path / "out").mkdir()
    if kind == "link":
        (tmp_path / "out" / guess).symlink_to(victim)
    else:
        os.mkfifo(tmp_path / "out" / guess)
    guesses = iter([bytes(8), b"somewhat"])  # even when it is guessed right
    monkeypatch.setattr(os, "urandom", lambda size: next(guesses))

    write_atomic(tmp_path / "out" / "map.png", b"data")

    assert victim.read_bytes() == b"precious"
    assert (tmp_path / "out" / "map.png").read_bytes() == b"data"
    assert names_in(tmp_path / "out") == [guess, "map.png"]


def test_two_processes_may_write_one_file_at_the_same_time(tmp_path):
    script = (
        "import sys\n"
        "from rollcli.files.atomic import write_atomic\n"
        "for _ in range(300):\n"
        "    write_atomic(sys.argv[1], bytes(100_000))\n"
    )
    target = tmp_path / "map.png"
    line = [sys.executable, "-c", script, target]
    writers = [subprocess.Popen(line, stderr=subprocess.PIPE) for _ in range(2)]
    sizes = set()
    while any(writer.poll() is None for writer in writers):
        remove_leftovers([target])  # as a third process does that begins with the same outputs
        if target.exists():
            sizes.add(len(target.read_bytes()))

    assert [writer.communicate()[1] for writer in writers] == [b"", b""]
    assert sizes == {100_000}
    assert names_in(tmp_path) == ["map.png"]


def test_a_block_that_fails_leaves_what_was_there(tmp_path):
    (tmp_path / "map.png").write_bytes(b"old")

    def fail():
        with atomic_file(tmp_path / "map.png") as file:
            file.write(b"new")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()

    assert names_in(tmp_path) == ["map.png"]
    assert (tmp_path / "map.png").read_bytes() == b"old"


@pytest.mark.skipif(os.name == "nt", reason="POSIX permissions")
@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_permissions_are_those_of_any_new_file(tmp_path, mask):
    before = os.umask(mask)
    try:
        write_atomic(tmp_path / "map.png", b"")
    finally:
        os.umask(before)

    assert stat.S_IMODE((tmp_path / "map.png").stat().st_mode) == 0o666 & ~mask


def test_what_cannot_be_written_is_named_in_one_line(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_bytes(b"")

    for path in (tmp_path / "folder", tmp_path / "file" / "map.png", tmp_path / ("x" * 300)):
        with pytest.raises(OutputError, match="cannot be written: ") as caught:
            write_atomic(path, b"data")
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)

    assert names_in(tmp_path) == ["file", "folder"]


@pytest.mark.skipif(os.name == "nt", reason="resource limits are POSIX")
def test_a_full_disk_leaves_nothing_behind(tmp_path):
    script = (
        "import resource, signal, sys\n"
        "from rollcli.errors import OutputError\n"
        "from rollcli.files.atomic import write_atomic\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try:\n"
        "    write_atomic(sys.argv[1], bytes(5000))\n"
        "except OutputError as error:\n"
        "    print(error)\n"
    )
    target = tmp_path / "map.png"

    done = python(script, target, check=True)

    assert done.stdout == f"{target}: cannot be written: file too large\n"
    assert done.stderr == ""
    assert names_in(tmp_path) == []


def test_a_mark_of_a_file_is_removed_with_its_leftovers(tmp_path):
    assert mark_path("out/rolls.csv") == "out/.rolls.csv.0000000000000000.part"
    assert mark_path("s3://bucket/rolls.csv") == "s3://bucket/.rolls.csv.0000000000000000.part"
    write_atomic(mark_path(str(tmp_path / "rolls.csv")), b"")
    remove_leftovers([tmp_path / "other.csv", "s3://bucket/rolls.csv"])
    assert names_in(tmp_path) == [".rolls.csv.0000000000000000.part"]
    remove_leftovers([tmp_path / "rolls.csv"])
    assert names_in(tmp_path) == []


def test_nothing_stays_open(tmp_path):
    before = open_descriptors()
    write_atomic(tmp_path / "a.png", b"data")
    write_atomic(tmp_path / "b.png", b"data", replaces=False)
    leave_half(tmp_path / "a.png")
    remove_leftovers([tmp_path / "a.png"])
    with pytest.raises(OutputError):
        write_atomic(tmp_path, b"data")
    folders = [tmp_path / str(number) for number in range(40)]
    for folder in folders:
        write_atomic(folder / "map.png", b"data")
    sync_files([folder / "map.png" for folder in folders])
    write_atomic(tmp_path / "c.png", b"data", durable=True)
    assert open_descriptors() == before
    assert names_in(tmp_path) == sorted([*map(str, range(40)), "a.png", "b.png", "c.png"])
