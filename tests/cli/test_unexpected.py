"""What nobody writes on purpose ends as one line that names it, and never as an internal error."""

import json
import threading

import numpy as np
import pytest

import rollcli as package
from rollcli.errors import UsageError
from rollcli.files.atomic import in_threads, sync_files
from rollcli.files.storage import fetch_all
from tests.run_cli import rollcli

ROW = {"file": "a.png", "status": "ok", "roll_deg": 1.0, "roll_ci95_deg": 0.1}
COMMANDS = {
    "rig": ["rig", "r.jsonl", "--format", "csv"],
    "report": ["report", "r.jsonl", "--svg", "s"],
    "accuracy": ["evaluate", "accuracy", "r.jsonl", "--truth", "truth.csv"],
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", ["file", "message"])
def test_half_a_character_is_no_text(tmp_path, command, name):
    (tmp_path / "r.jsonl").write_text(json.dumps({**ROW, name: "\ud800.png"}) + "\n")
    (tmp_path / "truth.csv").write_text("file,roll_deg\na.png,1\n")
    done = rollcli(*COMMANDS[command], cwd=tmp_path)
    if name == "file" or command != "rig":
        assert done.status == 2
        assert f"r.jsonl: line 1: '\\ud800.png' is no value for {name}" in done.err
    else:
        assert done.status == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_a_number_of_401_digits_is_no_angle(tmp_path, command):
    (tmp_path / "r.jsonl").write_text(json.dumps({**ROW, "roll_deg": 10**400}) + "\n")
    (tmp_path / "truth.csv").write_text("file,roll_deg\na.png,1\n")
    done = rollcli(*COMMANDS[command], cwd=tmp_path)
    assert done.status == 2
    assert "is no value for roll_deg" in done.err


@pytest.mark.parametrize("command", ["rig", "report"])
@pytest.mark.parametrize(
    ("kind", "value"),
    [("duration", 2**62), ("duration", 1), ("date32", 2**31 - 1), ("date32", 1), ("time64", 1)],
)
def test_times_of_parquet_are_no_angles(tmp_path, command, kind, value):
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
    from pyarrow import parquet

    types = {"duration": pyarrow.duration("s"), "date32": pyarrow.date32(), "time64": pyarrow.time64("ns")}
    angles = pyarrow.array([value], types[kind])
    parquet.write_table(
        pyarrow.table({"file": ["a.png"], "status": ["ok"], "roll_deg": angles}), tmp_path / "r.parquet"
    )
    done = rollcli(command, "r.parquet", *(["--svg", "s"] if command == "report" else []), cwd=tmp_path)
    assert done.status == 2
    assert "rollcli: r.parquet: " in done.err


def test_a_part_without_a_whole_line_is_damaged(tmp_path):
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "part-00000.csv").write_text("file,status,roll_deg")
    done = rollcli("rig", "r", cwd=tmp_path)
    assert done.status == 2
    assert "r/part-00000.csv: is damaged: it has no whole line" in done.err


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"tolerance": float("inf")}, {"tolerance": float("nan")}])
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        package.estimate_roll(np.ones((200, 200)), **wrong)


@pytest.mark.parametrize("threads", [0, 1])
def test_where_the_system_starts_no_more_threads_the_others_do_it_all(tmp_path, monkeypatch, threads):
    start, started = threading.Thread.start, []

    def starts_few(self):
        if len(started) == threads:
            raise RuntimeError("can't start new thread")
        started.append(self)
        start(self)

    monkeypatch.setattr(threading.Thread, "start", starts_few)
    files = [tmp_path / f"{number}" for number in range(40)]
    for file in files:
        file.write_bytes(b"x")
    sync_files(files)
    assert in_threads(len, [[0] * number for number in range(9)], 4) == list(range(9))
    assert list(fetch_all(map(str, files)).values()) == [b"x"] * 40
