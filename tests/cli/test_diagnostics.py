"""What a mistaken setting of the environment, and an error that nobody expected, say."""

import subprocess
import sys

import pytest

from tests.run_cli import environment, rollcli, write_maps


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "ROLLCLI_ESTIMATE_MAX_ROL",
            "there is no such option of rollcli estimate; did you mean ROLLCLI_ESTIMATE_MAX_ROLL?",
        ),
        ("ROLLCLI_ESTIMTE_JOBS", "there is no such command or setting; did you mean ROLLCLI_ESTIMATE_JOBS?"),
        ("ROLLCLI_STORE_TIMOUT", "there is no such command or setting; did you mean ROLLCLI_STORE_TIMEOUT?"),
        ("ROLLCLI_ESTIMATE_XYZZYPLUGH", "there is no such option of rollcli estimate"),
    ],
)
def test_a_variable_with_a_typo_is_said(tmp_path, name, said):
    write_maps(tmp_path / "maps", 1)
    done = rollcli("estimate", "maps", cwd=tmp_path, **{name: "4"})
    assert done.status == 0
    assert f"rollcli: {name}: {said}\n" in done.err
    assert name not in rollcli("estimate", "maps", "-q", cwd=tmp_path, **{name: "4"}).err


def test_variables_of_this_and_other_commands_are_not_said(tmp_path):
    write_maps(tmp_path / "maps", 1)
    known = {
        "ROLLCLI_ESTIMATE_MAX_ROLL": "30",
        "ROLLCLI_DEROTATE_ROL": "3",
        "ROLLCLI_EVALUATE_PAPER_TIMED": "2",
        "ROLLCLI_STORE_TIMEOUT": "5",
        "ROLLCLI_RIG_X": "1",
    }
    assert "ROLLCLI_" not in rollcli("estimate", "maps", cwd=tmp_path, **known).err


@pytest.mark.parametrize("arguments", [["-v"], ["--verbose"], []])
def test_verbose_shows_where_an_unexpected_error_is_from(tmp_path, arguments):
    code = f"""
import sys
import rollcli.run.estimate
rollcli.run.estimate.make_plan = lambda options: {{}}["key"]
sys.argv = ["rollcli", "estimate", ".", *{arguments}]
from rollcli.__main__ import main
main()
"""
    line = [sys.executable, "-c", code]
    done = subprocess.run(line, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 1
    first, *rest = done.stderr.splitlines()
    assert first.startswith("rollcli: internal error, please report it: KeyError: 'key'")
    assert ("Traceback" in done.stderr) == bool(arguments)
    assert not rest or any("run_estimate" in each for each in rest)
