"""Text as Windows writes it: with a mark at its start, and in UTF-16, as PowerShell's `>` does."""

import pytest

from tests.report.results import row, write_result
from tests.run_cli import rollcli, write_maps

ENCODINGS = ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"]
LINES = "maps/frame0.png\r\nmaps/frame1.png\r\n"


@pytest.fixture
def folder(tmp_path):
    write_maps(tmp_path / "maps", 2)
    write_result(tmp_path / "rolls.csv", [row(f"maps/frame{number}.png") for number in range(40)])
    return tmp_path


def refused(done, name):
    assert done.status == 2, done.err
    assert f"{name}: " in done.err
    return "UTF-16" in done.err


def recoded(path, encoding, text=None):
    text = path.read_text("utf-8") if text is None else text
    path.write_bytes(text.replace("\n", "\r\n").replace("\r\r", "\r").encode(encoding))


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("text", [LINES, LINES.rstrip(), LINES.replace("\r", "")])
def test_a_list_is_read_or_refused_by_its_name(folder, encoding, text):
    (folder / "list.txt").write_bytes(text.encode(encoding))
    done = rollcli("estimate", "--files-from", "list.txt", cwd=folder)
    if encoding in ("utf-8-sig", "utf-16", "utf-16-le"):
        assert done.status == 0, done.err
        assert [line.split(",")[0] for line in done.out.splitlines()[1:]] == LINES.split()
    else:
        assert refused(done, "list.txt")


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(
    "words",
    [
        ("rig", "rolls.csv"),
        ("report", "rolls.csv", "--svg", "s"),
        ("derotate", "maps", "--from", "rolls.csv", "-o", "o", "--dry-run"),
    ],
)
def test_a_result_is_read_or_refused_by_its_name(folder, encoding, words):
    write_result(folder / "rolls.csv", [row(f"maps/frame{number}.png") for number in range(2)])
    recoded(folder / "rolls.csv", encoding)
    done = rollcli(*words, cwd=folder)
    if encoding in ("utf-8-sig", "utf-16"):
        assert done.status == 0, done.err
    else:
        assert done.status == 0 or "rolls.csv: " in done.err


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_options_are_read_or_refused_by_their_files_name(folder, encoding):
    recoded(folder / "rollcli.toml", encoding, "quiet = true\n")
    done = rollcli("estimate", "maps", "--config", "rollcli.toml", cwd=folder)
    if encoding in ("utf-8-sig", "utf-16", "utf-16-le"):
        assert (done.status, done.err) == (0, "")
    else:
        assert refused(done, "rollcli.toml")
