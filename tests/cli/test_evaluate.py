"""`rollcli evaluate` as a user runs it."""

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


def test_accuracy_says_why_heights_that_are_asked_for_are_not_compared(folder):
    for name in ("out", "heights", "disparity"):
        (folder / name).mkdir()
        np.save(folder / name / "a.npy", np.ones((2, 3), np.float32))
    unasked, asked = accuracy(folder).err, accuracy(folder, "--heights", "out").err
    assert asked.startswith("rollcli: out: no heights are compared: they need metres (estimate --calib), and")
    assert asked.partition("\n")[2] == unasked


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
