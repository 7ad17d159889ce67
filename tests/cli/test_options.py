"""The options: declared once, with the defaults of what they are handed to."""

import inspect
import math

import click
import pytest

from rollcli.cli.main import COMMANDS, main
from rollcli.estimator.estimate import estimate_roll
from rollcli.files.results import FURTHER, columns
from rollcli.run.options import MethodOptions
from tests.readme_tables import OPTIONS_PAGE, commands
from tests.run_cli import ROOT

ESTIMATE = main.get_command(click.Context(main), "estimate")


def test_the_defaults_of_the_method_are_those_of_the_library():
    library = {name: p.default for name, p in inspect.signature(estimate_roll).parameters.items()}
    given = MethodOptions()
    for name in ("method", "model", "road", "lambda0", "seed"):
        assert getattr(given, name) == library[name]
    assert math.radians(given.tolerance_deg) == pytest.approx(library["tolerance"])
    assert math.radians(given.max_roll_deg) == pytest.approx(library["max_roll"])


@pytest.mark.parametrize("param", ESTIMATE.params, ids=lambda param: param.name)
def test_every_option_has_a_help_text(param):
    assert isinstance(param, click.Argument) or param.help


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_is_there_has_a_line_of_help(name):
    assert COMMANDS[name][1].endswith(".")


def test_every_option_is_on_the_page_of_options():
    readme = OPTIONS_PAGE.read_text("utf-8")
    flags = [flag for param in ESTIMATE.params if isinstance(param, click.Option) for flag in param.opts]
    assert [flag for flag in flags if f"`{flag}`" not in readme and f"`{flag} " not in readme] == []


def test_every_column_and_exit_status_is_documented_in_the_readme():
    readme = (ROOT / "README.md").read_text("utf-8")
    assert [name for name in columns(FURTHER) if f"`{name}`" not in readme] == []
    assert all(f"\n| {status} | " in readme for status in (0, 1, 2, 3, 130))


PATHS = [
    (ctx, param)
    for _, ctx in commands()
    for param in ctx.command.params
    if isinstance(param.type, click.Path)
]


@pytest.mark.parametrize(("ctx", "param"), PATHS, ids=lambda each: getattr(each, "name", None) or "of")
def test_an_empty_name_is_never_taken_for_the_current_folder(ctx, param):
    with pytest.raises(click.BadParameter, match="the name is empty: is a variable unset"):
        param.type_cast_value(ctx, ("",) if param.nargs == -1 or param.multiple else "")


OPTIONS = [
    (ctx, param) for _, ctx in commands() for param in ctx.command.params if isinstance(param, click.Option)
]


@pytest.mark.parametrize(("ctx", "param"), OPTIONS, ids=lambda each: getattr(each, "name", None) or "of")
def test_the_environment_and_config_files_call_an_option_by_its_flag(ctx, param):
    flag = max(param.opts, key=len).removeprefix("--")
    assert param.name == flag.replace("-", "_")
