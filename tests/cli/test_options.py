"""The options: declared once, with the defaults of what they are handed to."""

import inspect
import math

import click
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.files.results import FURTHER, columns
from rollcli.run.options import MethodOptions
from tests.readme_tables import commands
from tests.run_cli import ROOT


def test_the_defaults_of_the_method_are_those_of_the_library():
    library = {name: p.default for name, p in inspect.signature(estimate_roll).parameters.items()}
    given = MethodOptions()
    for name in ("method", "model", "road", "lambda0", "seed"):
        assert getattr(given, name) == library[name]
    assert math.radians(given.tolerance_deg) == pytest.approx(library["tolerance"])
    assert math.radians(given.max_roll_deg) == pytest.approx(library["max_roll"])


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
