"""Names of a sorted list, read as they are needed, are those of a list that is read and sorted at once."""

import sys

import pytest

from rollcli.files import inputs as manifests
from rollcli.files.inputs import Manifest
from rollcli.files.naming import natural_key
from tests.files.test_sizes import PEAK
from tests.run_cli import python


@pytest.fixture
def names(tmp_path, monkeypatch):
    """1,000 sorted names and the file that lists them, with blank lines and both kinds of line ends."""
    monkeypatch.setattr(manifests, "_BLOCK", 7)
    every = sorted((f"a{i % 3}/frame{i}.png" for i in range(1000)), key=natural_key)
    ends = ["\n", "\r\n", "\n\n"]
    text = "".join(name + ends[i % 3] for i, name in enumerate(every))
    (tmp_path / "list.txt").write_bytes(text.encode())
    return every, str(tmp_path / "list.txt")


@pytest.mark.parametrize(
    "part",
    [
        slice(None),
        slice(5, 9),
        slice(993, None),
        slice(3, None, 8),
        slice(6, 8),
        slice(9, 9),
        slice(-1, None),
    ],
)
def test_any_run_of_names_is_read_from_its_place(names, part):
    every, path = names
    manifest = Manifest(path)
    assert len(manifest) == 1000
    assert list(manifest.names(range(1000)[part])) == every[part]


def test_a_byte_order_mark_is_one_at_the_start_of_the_file_alone(tmp_path):
    path = tmp_path / "names.txt"
    path.write_text("\ufeffa.png\nb.png\n\ufeffc.png\n", "utf-8")
    assert list(Manifest(path).names(range(3))) == ["a.png", "b.png", "\ufeffc.png"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is counted in other units elsewhere")
def test_a_long_list_takes_no_memory(tmp_path):
    peaks, listed = [], tmp_path / "listed"
    for count in (1000, 200_000):
        (tmp_path / "list.txt").write_text("".join(f"/none/frame{i:09}.png\n" for i in range(count)))
        line = ("estimate", "--files-from", "list.txt", "--sorted", "--dry-run")
        with listed.open("wb") as out:
            done = python(PEAK, "-m", "rollcli", *line, cwd=tmp_path, stdout=out)
        assert listed.read_bytes().count(b"\n") == count, done.stderr
        peaks.append(int(done.stderr.split()[-1]))
    assert peaks[1] - peaks[0] < 8_000  # a list of the names alone would take 14 MB
