"""A result takes retried rows where the system renames onto no open file, as Windows does."""

import os
from pathlib import Path

import pytest

from rollcli.errors import UsageError
from rollcli.files.results import format_header
from rollcli.run import result_file
from rollcli.run.result_file import open_result

HEADER = format_header("csv")


@pytest.fixture
def path(tmp_path, monkeypatch):
    """A result of three rows, on a system that behaves like Windows."""
    path = tmp_path / "rolls.csv"
    path.write_bytes(HEADER + b"a\nb\nc\n")
    replace = Path.replace

    def only_closed(self, target):
        if Path(target) == path and any(same(link, path) for link in Path("/proc/self/fd").iterdir()):
            raise PermissionError(13, "The process cannot access the file")
        return replace(self, target)

    monkeypatch.setattr(result_file, "_ON_WINDOWS", True)
    monkeypatch.setattr(Path, "replace", only_closed)
    return path


def same(link, path):
    try:
        return os.path.samestat(link.stat(), path.stat())
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs /proc, which lists open files")
def test_rows_are_replaced_and_the_result_stays_locked_and_grows(path):
    with open_result(str(path)) as file:
        file.replace({1: b"B\n"}, "csv")
        assert path.read_bytes() == HEADER + b"a\nB\nc\n"
        with pytest.raises(UsageError, match="another run is writing"), open_result(str(path)):
            pass
        file.replace({0: b"A\n"}, "csv")
        file.append(b"d\n")
    assert path.read_bytes() == HEADER + b"A\nB\nc\nd\n"
    assert [each.name for each in path.parent.iterdir()] == ["rolls.csv"]
