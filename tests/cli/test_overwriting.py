"""What another program writes between the look and the write stays, and the later one says so."""

from importlib import import_module

import pytest

from tests.report.results import row, write_result
from tests.run_cli import rollcli, write_maps

COMMANDS = {
    "rig": ("rollcli.run.rig", ["rig", "rolls.csv", "-o", "out.txt"], "out.txt"),
    "page": ("rollcli.report.run", ["report", "rolls.csv", "-o", "out.html", "--gallery", "0"], "out.html"),
    "charts": ("rollcli.report.run", ["report", "rolls.csv", "--svg", "s"], "s/roll.svg"),
    "accuracy": (
        "rollcli.evaluate.run_accuracy",
        ["evaluate", "accuracy", "rolls.csv", "--truth", "truth.csv", "-o", "out.txt"],
        "out.txt",
    ),
    "paper": (
        "rollcli.evaluate.paper",
        ["evaluate", "paper", "maps", "-o", "p", "--turns=-2:2:2", "--timed", "1"],
        "p/paper.html",
    ),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_later_of_two_does_not_replace_what_the_first_wrote(tmp_path, monkeypatch, name):
    module, words, output = COMMANDS[name]
    write_maps(tmp_path / "maps", 1)
    write_result(tmp_path / "rolls.csv", [row(f"frame{number}.png") for number in range(40)])
    (tmp_path / "truth.csv").write_text("file,roll_deg\nframe0.png,1\n")
    check = import_module(module).check_writes
    written = tmp_path / output

    def checked_then_written_by_another(*arguments, **settings):
        check(*arguments, **settings)
        written.parent.mkdir(exist_ok=True)
        written.write_bytes(b"another's")

    monkeypatch.setattr(f"{module}.check_writes", checked_then_written_by_another)
    done = rollcli(*words, cwd=tmp_path)
    assert done.status == 2
    assert f"{output}: exists already; give --overwrite to replace it" in done.err
    assert written.read_bytes() == b"another's"
    assert rollcli(*words, "--overwrite", cwd=tmp_path).status in (0, 3)
    assert written.read_bytes() != b"another's"
