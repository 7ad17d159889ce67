"""The options: declared once, with the defaults of what they are handed to."""

import inspect
import math

import click
import pytest

from rollcli.batch.options import MethodOptions
from rollcli.cli.main import COMMANDS, main
from rollcli.estimator.estimate import estimate_roll

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
