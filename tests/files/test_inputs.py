"""Inputs are found, or it is said what keeps them from being found."""

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rollcli.errors import UsageError
from rollcli.files.inputs import find_inputs
from rollcli.files.search import Search


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder, and a function that fills it."""
    monkeypatch.chdir(tmp_path)

    def fill(*names):
        for name in names:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"x")
        return tmp_path

    return fill


def names(found):
    return [each.name for each in found]


def test_stdin_is_read_and_a_closed_one_is_named(here, monkeypatch):
    here("ä.png")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO("ä.png\n".encode())))

    assert names(find_inputs(["-"], Search())) == ["ä.png"]
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(UsageError, match="stdin is closed"):
        find_inputs(["-"], Search())


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no names that are no text")
def test_names_that_are_no_text_are_found(here):
    root = here("a.png")
    name = os.fsdecode(b"\xff.png")
    (root / name).write_bytes(b"x")
    (root / "list.txt").write_bytes(b"\xff.png\n")

    assert names(find_inputs([], Search(), files_from="list.txt")) == [name]
    assert name in names(find_inputs(["."], Search()))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_pipes_and_folders_with_readable_endings_are_no_files(here):
    root = here("maps/f1.png", "maps/folder.png/f2.png")
    os.mkfifo(root / "maps" / "pipe.png")

    assert names(find_inputs(["maps"], Search())) == ["maps/f1.png"]


@pytest.fixture
def deep(here):
    """A folder in a folder, a thousand times, with a map in the last."""
    root = here("deep/map.png")
    os.chdir("deep")
    for _ in range(1000):
        Path("d").mkdir()
        os.chdir("d")
    Path("map.png").touch()
    os.chdir(root)
    yield "deep"
    subprocess.run(["rm", "-rf", root / "deep"], check=True)  # shutil fails at this depth


@pytest.mark.skipif(os.name == "nt", reason="paths have no such length")
def test_a_thousand_nested_folders_are_searched(deep):
    found = find_inputs([deep], Search(recursive=True))

    assert [each.relative for each in found] == ["d/" * 1000 + "map.png", "map.png"]
    with pytest.raises(UsageError, match="too deep for a pattern; name the folder, with --recursive"):
        find_inputs([f"{deep}/**/*.png"], Search())


def test_a_file_that_the_system_refuses_to_look_at_is_an_input_that_its_row_will_explain(here, monkeypatch):
    here("maps/a.png", "maps/b.png")
    stat = os.stat

    def refuse(path, **options):
        if str(path).endswith("a.png"):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", refuse)

    assert names(find_inputs(["maps"], Search())) == ["maps/a.png", "maps/b.png"]
