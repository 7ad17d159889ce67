"""A result of parts in a folder: what is in the way, damaged, or left by a run that was killed."""

import errno
import os

import pytest

from rollcli.errors import OutputError
from rollcli.run import batch
from tests.run_cli import contents, leave_half, rollcli, write_maps


@pytest.fixture
def parts(tmp_path):
    """A whole result of three parts, the command that made it, and what there is."""
    line = ("estimate", "maps", "-o", "rolls.parquet", "--part-rows", "2")
    write_maps(tmp_path / "maps", 6)
    assert rollcli(*line, cwd=tmp_path).status == 0
    return tmp_path, line, contents(tmp_path)


@pytest.mark.parametrize(
    "half_written",
    ["parquet/part-00001.parquet", "parquet/part-00002.parquet", "parquet.inputs/part-00002.inputs"],
)
@pytest.mark.parametrize("flag", ["--resume", "--overwrite"])
def test_half_a_part_of_a_killed_run_is_removed(parts, half_written, flag):
    folder, line, whole = parts
    (folder / "rolls.parquet" / "part-00002.parquet").unlink()
    leave_half(folder / f"rolls.{half_written}")
    assert len(contents(folder)) == len(whole)

    assert rollcli(*line, flag, cwd=folder).status == 0

    assert contents(folder) == whole


@pytest.mark.parametrize(("gone", "kept"), [((1, 2), 2), ((0,), 4), ((0, 1), 2)])
def test_a_full_disk_keeps_the_other_parts_and_says_how_to_go_on(parts, gone, kept, monkeypatch):
    folder, line, whole = parts
    for number in gone:
        (folder / "rolls.parquet" / f"part-0000{number}.parquet").unlink()

    def no_room(location, data, run):
        raise OutputError(f"{location}: cannot be written: no space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(batch, "create", no_room)
        done = rollcli(*line, "--resume", "-j", "1", cwd=folder, status=1)
    assert done.err.endswith(
        f"rollcli: rolls.parquet/part-0000{gone[0]}.parquet: cannot be written: no space left on device; "
        f"{kept} rows kept, continue with --resume\n"
    )
    assert rollcli(*line, "--resume", cwd=folder).status == 0
    assert contents(folder) == whole


@pytest.mark.parametrize(("path", "fails"), [("maps/frame3.png", "odd"), ("rolls.parquet", "all")])
@pytest.mark.parametrize("flag", ["--overwrite", "--resume"])
def test_a_momentary_fault_of_the_disk_does_not_keep_a_run_from_resume(parts, path, fails, flag, monkeypatch):
    folder, line, whole = parts
    (folder / "rolls.parquet" / "part-00001.parquet").unlink()
    look, asked = os.stat, []

    def failing(target, **named):
        if str(target).endswith(path):
            asked.append(target)
            if fails == "all" or len(asked) % 2:
                raise OSError(errno.EIO, os.strerror(errno.EIO), str(target))
        return look(target, **named)

    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", failing)
        done = rollcli(*line, flag, cwd=folder)
    assert asked
    if done.status:
        assert fails == "all"
        assert done.err == "rollcli: rolls.parquet: cannot be written: input/output error\n"

    assert rollcli(*line, "--resume", cwd=folder).status == 0
    assert contents(folder) == whole
