"""What options take, and how sessions at a prompt go; see `tests.sessions` and `tests.recorded`."""

import json
import math
from functools import partial
from pathlib import Path

import click

from rollcli.cli import types
from tests import sessions
from tests.readme_tables import commands
from tests.recorded import recorded_test


@sessions.parametrize("cli")
def test_a_session_goes_as_it_is_written_down(tmp_path, heading):
    sessions.check("cli", heading, tmp_path)


VALUES = Path(__file__).with_name("values.txt").read_text("utf-8").partition("\n\n")[2]
KINDS = {
    "ANGLE": types.Number("DEG", above=0, at_most=90, auto="auto"),
    "CHOICE": types.Choice("gd", "gss"),
    "COUNT": types.Number("N", whole=True, at_least=1),
    "FILE": types.FilePath(),
    "OUTPUT": types.OutputFile((".csv",), "CSV"),
    "PX": types.Number("PX"),
    "SPAN": types.span(-5, 5.5),
}
# what lies on a bound of some option, and hardly beyond it
NUMBERS = (
    "-180.001 -180 -16 -1 -0.001 -1e-9 0 1e-9 0.5 0.999 1 1.001 1.5 9 12 13 16 26 89 89.001 90 90.001 100 "
    "101 180 180.001 65535 65536 1e9 auto Auto nan inf x"
)


def _converted(kind, text):
    try:
        found = kind.convert(json.loads(text) if text[:1] in ("[", "t") else text, None, None)
    except click.UsageError as error:
        return error.message
    return [type(found).__name__, found]


def _value(line):
    kind, _, text = line.partition(" ")
    kind = KINDS.get(kind) or getattr(types, kind)
    return [kind.metavar, _converted(kind, text)]


def _numbers(kind):
    return [text for text in NUMBERS.split() if isinstance(_converted(kind, text), list)]


def _bounded():
    """Each option that takes a number within bounds."""
    for name, context in commands():
        for each in context.command.params:
            kind = each.type
            if isinstance(kind, types.Number):
                bounds = kind.above, kind.at_least, -kind.at_most
                if kind.whole or any(map(math.isfinite, bounds)):
                    yield f"{name} {each.opts[-1]}", kind


CASES = {
    **{line: partial(_value, line) for line in filter(None, VALUES.split("\n"))},
    **{f"numbers of {name}": partial(_numbers, kind) for name, kind in _bounded()},
    "ranges of simulate": lambda: {
        each.opts[-1]: each.type.what
        for name, context in commands()
        for each in context.command.params
        if name == "simulate" and isinstance(each.type, types.Parsed)
    },
}

test_answers_are_those_recorded = recorded_test("cli", CASES)
