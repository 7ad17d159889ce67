"""A result of parts in a folder: what a killed run left behind is gone after a resume."""

import subprocess
import sys

import pytest

from tests.run_cli import contents, rollcli, write_maps

HALF_WRITTEN = (
    "import os, sys\n"
    "from rollcli.files.atomic import atomic_file\n"
    "with atomic_file(sys.argv[1]) as file:\n"
    "    file.write(b'half of a file')\n"
    "    file.flush()\n"
    "    os._exit(9)\n"
)


@pytest.mark.parametrize("half_written", ["part-00000.parquet", "part-00001.parquet", "part-00002.parquet"])
@pytest.mark.parametrize("flag", ["--resume", "--overwrite"])
def test_half_a_part_of_a_killed_run_is_removed(tmp_path, half_written, flag):
    pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
    line = ("estimate", "maps", "-o", "rolls.parquet", "--part-rows", "2")
    write_maps(tmp_path / "maps", 6)
    assert rollcli(*line, cwd=tmp_path).status == 0
    whole = contents(tmp_path)
    (tmp_path / "rolls.parquet" / "part-00002.parquet").unlink()
    subprocess.run(
        [sys.executable, "-c", HALF_WRITTEN, tmp_path / "rolls.parquet" / half_written], check=False
    )
    assert len(contents(tmp_path)) == len(whole)

    assert rollcli(*line, flag, cwd=tmp_path).status == 0

    assert contents(tmp_path) == whole
