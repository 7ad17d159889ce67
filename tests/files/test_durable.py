"""What must survive a power cut is forced to the disk: bytes first, then names, each folder once."""

import errno
import os
import stat
from pathlib import Path
from unittest.mock import Mock

import pytest

from rollcli.errors import OutputError
from rollcli.files.atomic import sync_files, write_atomic

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows forces no folders")


def inode(path):
    return path.stat().st_ino


def test_files_are_forced_before_the_folders_that_name_them(tmp_path, synced):
    paths = [tmp_path / "a" / "b" / f"{number}.png" for number in range(5)] + [tmp_path / "a" / "c.png"]
    for path in paths:
        write_atomic(path, b"data")
    assert synced == []

    sync_files(paths)

    order = [each for each, _ in synced]
    assert set(order[:6]) == {inode(path) for path in paths}
    assert set(order[6:]) >= {inode(tmp_path / "a" / "b"), inode(tmp_path / "a"), inode(tmp_path)}
    assert len(order) == len(set(order))


def test_a_durable_file_has_its_bytes_on_the_disk_before_it_has_its_name(tmp_path, synced, monkeypatch):
    replace = Path.replace

    def watched(path, target):
        assert synced == [(inode(path), 4)]
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", watched)

    write_atomic(tmp_path / "run.json", b"data", durable=True)

    assert inode(tmp_path) in {each for each, _ in synced[1:]}


def test_a_disk_that_fails_is_said_in_one_line(tmp_path, monkeypatch):
    write_atomic(tmp_path / "map.png", b"data")

    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(errno.EIO, os.strerror(errno.EIO))))

    with pytest.raises(OutputError, match=r"map\.png: cannot be forced to the disk: input/output error$"):
        sync_files([tmp_path / "map.png"])
    with pytest.raises(OutputError, match=r"new\.png: cannot be written: input/output error$"):
        write_atomic(tmp_path / "new.png", b"data", durable=True)

    assert not (tmp_path / "new.png").exists()


def test_folders_whose_names_are_on_the_disk_are_not_named_again(tmp_path, synced):
    first, second = tmp_path / "a" / "b" / "1.png", tmp_path / "a" / "b" / "2.png"
    named = set()
    for path in (first, second):
        write_atomic(path, b"data")
        synced.clear()
        sync_files([path], named)
    assert {each for each, _ in synced} == {inode(second), inode(second.parent)}


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES, errno.EPERM])
def test_a_file_system_that_forces_no_folders_is_no_error_and_a_disk_that_fails_is(
    tmp_path, monkeypatch, number
):
    write_atomic(tmp_path / "map.png", b"data")
    fsync = os.fsync

    def fail(number):
        def call(descriptor):
            if stat.S_ISDIR(os.fstat(descriptor).st_mode):
                raise OSError(number, os.strerror(number))
            fsync(descriptor)

        return call

    monkeypatch.setattr(os, "fsync", fail(number))
    sync_files([tmp_path / "map.png"])
    monkeypatch.setattr(os, "fsync", fail(errno.EIO))
    with pytest.raises(OutputError, match=r"cannot be forced to the disk: input/output error$"):
        sync_files([tmp_path / "map.png"])
