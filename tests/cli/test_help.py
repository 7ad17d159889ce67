"""Each command's manual page, and what is documented of options."""

import re
import shlex

import click
import pytest

from rollcli.estimator.request import Request
from rollcli.files.results import FURTHER, columns
from rollcli.run.options import MethodOptions
from tests.cli.test_main import output_and_loaded
from tests.readme_tables import commands
from tests.run_cli import ROOT, rollcli

COMMANDS = dict(commands())


@pytest.mark.parametrize("name", COMMANDS)
def test_it_has_examples_and_statuses_and_loads_nothing_heavy(tmp_path, name):
    heavy = "numpy cv2 tqdm tifffile plotly jinja2 dask"
    *page, loaded = output_and_loaded(tmp_path, [*name.split(), "--help"], heavy)
    assert loaded == "0 []"
    for heading in ("Running:", "Examples:", "Environment:", "Exit status:"):
        assert heading in page
    assert page[0].startswith(f"Usage: rollcli {name} ")
    headings = [line for line in page if line.endswith(":") and not line.startswith(" ")]
    assert headings[headings.index("Examples:") - 1] == "Other options:"


@pytest.mark.parametrize("name", COMMANDS)
def test_its_examples_are_commands_that_the_program_takes(name):
    ctx = COMMANDS[name]
    lines = [line for _, steps in ctx.command.examples for line in steps.splitlines()]
    for line in lines:
        for words in parts(line):
            command = COMMANDS[" ".join(words[:2]) if words[0] == "evaluate" else words[0]].command
            arguments = words[2:] if words[0] == "evaluate" else words[1:]
            assert isinstance(command.make_context(name, arguments), click.Context)
    assert any(words[: len(name.split())] == name.split() for line in lines for words in parts(line))


def parts(line):
    """The words after `rollcli` of each part of a pipe that starts it."""
    return [shlex.split(part)[1:] for part in line.split("|") if part.split()[0] == "rollcli"]


def test_rig_and_report_tell_how_they_end_themselves():
    ends = {
        name: rollcli(name, "--help", cwd=ROOT).out.partition("Exit status:")[2].split("\n\n")[0]
        for name in ("rig", "report", "estimate")
    }
    starts = {name: re.findall(r"^  (\d+) ", text, flags=re.M) for name, text in ends.items()}
    assert starts == {
        "rig": ["0", "1", "2", "4", "5", "130"],
        "report": ["0", "1", "2", "3", "130"],
        "estimate": ["0", "1", "2", "3", "130"],
    }
    assert "every check holds" in ends["rig"]
    assert "page" in ends["report"]
    assert "every frame" not in ends["rig"] + ends["report"]


def test_the_defaults_of_the_method_are_those_of_the_library():
    assert MethodOptions().request() == Request()


def test_every_column_and_exit_status_is_documented_in_the_readme():
    readme = (ROOT / "README.md").read_text("utf-8")
    assert [name for name in columns(FURTHER) if f"`{name}`" not in readme] == []
    assert all(f"\n| {status} | " in readme for status in (0, 1, 2, 3, 130))


PARAMS = [(ctx, param) for _, ctx in commands() for param in ctx.command.params]


@pytest.mark.parametrize(("ctx", "param"), PARAMS, ids=lambda each: getattr(each, "name", None) or "of")
def test_it_is_called_by_its_flag_says_what_it_does_and_takes_nothing_empty(ctx, param):
    if isinstance(param, click.Option):
        assert param.name == max(param.opts, key=len).removeprefix("--").replace("-", "_")
        assert param.help.endswith(".") or "[default:" in param.help
    # an empty path would be the current folder
    if isinstance(param.type, click.Path | click.types.StringParamType):
        with pytest.raises(click.BadParameter, match="is empty: is a variable unset"):
            param.type_cast_value(ctx, ("",) if param.nargs == -1 or param.multiple else "")
