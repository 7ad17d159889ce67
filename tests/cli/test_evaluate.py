"""`rollcli evaluate` as a user runs it."""

import json
import re
import sys

import numpy as np
import pytest

from tests.run_cli import rollcli, write_maps

RESULT = """file,status,roll_deg,roll_ci95_deg
maps/a.png,ok,1.100000,0.200000
maps/b.png,suspect,2.700000,0.200000
maps/c.png,error,,
maps/d.png,ok,4.000000,
"""
TRUTH = "file,roll_deg\na,1\nb,2\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "rolls.csv").write_text(RESULT)
    (tmp_path / "truth.csv").write_text(TRUTH)
    return tmp_path


def accuracy(folder, *arguments):
    return rollcli("evaluate", "accuracy", "rolls.csv", "--truth", "truth.csv", *arguments, cwd=folder)


def test_accuracy_prints_a_table_and_names_what_has_no_known_angle(folder):
    done = accuracy(folder)
    assert done.status == 0
    assert "frames compared           2 (1 suspect)" in done.out
    assert "worst                     0.7000 degrees  maps/b.png" in done.out
    assert "inside the 95 % interval  50.0 % (1 of 2)" in done.out
    assert done.err.splitlines() == [
        "rollcli: rolls.csv: 2 frames have no known angle in truth.csv: maps/c.png, maps/d.png"
    ]


def test_accuracy_says_why_heights_that_are_asked_for_are_not_compared(folder):
    for name in ("out", "heights", "disparity"):
        (folder / name).mkdir()
        np.save(folder / name / "a.npy", np.ones((2, 3), np.float32))
    unasked, asked = accuracy(folder).err, accuracy(folder, "--heights", "out").err
    assert asked.startswith("rollcli: out: no heights are compared: they need metres (estimate --calib), and")
    assert asked.partition("\n")[2] == unasked


def test_accuracy_ends_with_3_when_a_known_frame_has_no_angle(folder):
    (folder / "truth.csv").write_text(TRUTH + "c,3\ne,5\n")
    done = accuracy(folder, "--format", "json")
    assert done.status == 3
    assert json.loads(done.out)["no_angle"] == ["c", "e"]
    assert "rollcli: truth.csv: 2 frames have no angle in rolls.csv: c, e\n" in done.err


@pytest.mark.parametrize(
    ("compared", "bend", "words"),
    [(1, -1e-3, "2 frames, whose roads bend"), (2, 0, "1 frame, whose road bends")],
)
def test_poses_over_bent_roads_are_counted_because_they_are_not_compared(tmp_path, compared, bend, words):
    pose = {"status": "ok", "roll_deg": 1.0, "pitch_deg": 3.0, "height_m": 1.5}
    lines = [json.dumps({"file": f"{name}.png", **pose}) for name in "abc"]
    (tmp_path / "rolls.jsonl").write_text("".join(f"{line}\n" for line in lines))
    (tmp_path / "truth.csv").write_text(
        f"file,roll_deg,pitch_deg,height_m,curvature_per_m\na,1,3,1.5,0\nb,1,3,1.5,1e-3\nc,1,3,1.5,{bend}\n"
    )
    line = ("evaluate", "accuracy", "rolls.jsonl", "--truth", "truth.csv")
    done = rollcli(*line, cwd=tmp_path)
    assert re.search(rf"^pitch, frames compared +{compared}$", done.out, re.MULTILINE)
    said = f"rollcli: truth.csv: pitch and height are not compared on {words}"
    assert done.err == f"{said} (curvature_per_m)\n"
    assert rollcli(*line, "-q", cwd=tmp_path).err == ""


def test_accuracy_writes_a_file_in_the_format_asked_for(folder):
    assert accuracy(folder, "--format", "csv", "-o", "figures.csv", "-q") == (0, "", "")
    assert (folder / "figures.csv").read_text().startswith("count,median_deg,")
    assert accuracy(folder, "-o", "figures.csv", "--overwrite", "--format", "Table").status == 0
    assert (folder / "figures.csv").read_text().startswith("frames compared")


@pytest.mark.parametrize(
    "command", [("evaluate", "accuracy", "rolls.csv", "--truth", "truth.csv"), ("rig", "rolls.csv")]
)
def test_the_ending_of_the_output_says_its_format(folder, command):
    for name in ("found.json", "found.csv", "found.txt"):
        assert rollcli(*command, "-o", name, cwd=folder).status == 0
    assert isinstance(json.loads((folder / "found.json").read_text()), dict)
    assert (folder / "found.csv").read_text().splitlines()[0].count(",") > 5
    assert "  " in (folder / "found.txt").read_text().splitlines()[0]
    refusal = rollcli(*command, "-o", "found.xlsx", cwd=folder).refused()
    assert ".xlsx is not written here; write CSV (.csv), JSON (.json)" in refusal


def test_accuracy_never_replaces_what_it_reads(folder):
    assert "would be replaced" in accuracy(folder, "-o", "truth.csv", "--overwrite").refused()
    assert (folder / "truth.csv").read_text() == TRUTH


def test_evaluate_alone_shows_its_commands(tmp_path):
    done = rollcli("evaluate", cwd=tmp_path)
    assert done.status == 0
    assert "accuracy" in done.out
    assert "paper" in done.out


@pytest.mark.parametrize("missing", ["plotly", "jinja2", "matplotlib"])
def test_without_the_extra_paper_says_what_to_install_before_any_work(tmp_path, monkeypatch, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    write_maps(tmp_path / "maps", 1)
    refusal = rollcli("evaluate", "paper", "maps", "-o", "out", cwd=tmp_path).refused()
    assert f"needs the extra report: {sys.executable} -m pip install {missing}\n" in refusal
    assert not (tmp_path / "out").exists()
