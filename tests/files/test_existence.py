"""What a path is: asked of a system that fails once, or always."""

import errno
import os

import pytest

from rollcli.files.atomic import is_file, is_folder, is_mount, is_there, look_at


@pytest.fixture
def failing(monkeypatch):
    """Let calls of the system that look at a path fail with an error, as often as told."""

    def fail(number, times):
        left = {"times": times}

        def failing_call(call):
            def wrapper(path, *args, **options):
                if left["times"]:
                    left["times"] -= 1
                    raise OSError(number, os.strerror(number), str(path))
                return call(path, *args, **options)

            return wrapper

        for name in ("stat", "lstat"):
            monkeypatch.setattr(os, name, failing_call(getattr(os, name)))

    return fail


def test_an_error_of_the_disk_that_passes_changes_no_answer(tmp_path, failing):
    (tmp_path / "file").write_bytes(b"seven..")
    failing(errno.EIO, 1)
    assert is_folder(tmp_path)
    failing(errno.EIO, 1)
    assert is_file(tmp_path / "file")
    failing(errno.EIO, 1)
    assert look_at(tmp_path / "file").st_size == 7


def test_what_the_system_never_looks_at_is_not_there(tmp_path, failing):
    failing(errno.EIO, 100)
    assert not is_folder(tmp_path)
    assert not is_there(tmp_path)
    assert not is_mount(tmp_path)
    with pytest.raises(OSError, match="Input/output error"):
        look_at(tmp_path)


def test_other_errors_are_believed_at_once(tmp_path, failing):
    failing(errno.EACCES, 1)
    assert not is_there(tmp_path)
    assert is_there(tmp_path)


@pytest.mark.parametrize("name", ["\0", "x" * 300, ""])
def test_names_that_no_file_can_have_are_not_there(name):
    assert not is_there(name)
    assert not is_folder(name)
    assert not is_file(name)
