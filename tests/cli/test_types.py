"""Which values each kind of option takes, at its bounds and beyond them; any number ends in one line."""

import contextlib

import click
import pytest
from click.testing import CliRunner

from rollcli.cli.main import main
from rollcli.cli.types import Number, table_format
from rollcli.errors import ExitStatus, RollcliError
from rollcli.files.codecs import png as mute_stderr
from tests.readme_tables import commands
from tests.run_cli import write_maps


def test_a_whole_number_is_one_also_where_it_is_written_as_a_float():
    kind = Number("N", whole=True)
    assert [type(kind.convert(value, None, None)) for value in ("7", 7, 7.0)] == [int] * 3


def test_a_table_has_the_format_given_else_that_of_its_ending():
    names = ("a.csv", "A.JSON", "a.txt", "-", "table")
    assert [table_format(None, name) for name in names] == ["csv", "json", "table", "table", "table"]
    assert table_format("json", "a.csv") == "json"


NUMBERS = (
    "0", "-0.0", "1", "-1", "0.5", "1e-320", "1e9", "-1e9", "1e300", "1e308", "1e999", "nan", "inf", "-inf",
    "9" * 30, "9" * 5000, "0x10", "1_000", "٣", "1e", "", " ",
)  # fmt: skip
OPTIONS = sorted(
    (name, option.opts[0])
    for name, context in commands()
    for option in context.command.params
    if isinstance(option, click.Option)
    and not option.is_flag
    and option.name not in ("help", "version", "config")
)
NO_NUMBERS = (click.Path, click.Choice, click.types.StringParamType, click.types.BoolParamType)


def option_of(name, flag):
    """The command's context, and one of its options."""
    context = next(context for found, context in commands() if found == name)
    return context, next(each for each in context.command.params if flag in each.opts)


def lists_of(number):
    """The number alone, and where options take several: pairs, boxes, corners, shards."""
    return (
        number,
        f"{number},{number}",
        f"{number}/{number}",
        ",".join([number] * 4),
        f"{number},0 9,{number} 9,9",
    )


@pytest.mark.parametrize(("name", "flag"), OPTIONS, ids=map(" ".join, OPTIONS))
def test_any_number_is_taken_or_refused_with_a_usage_error(name, flag):
    context, option = option_of(name, flag)

    for text in (each for number in NUMBERS for each in lists_of(number)):
        given = [text] * option.nargs if option.nargs > 1 else [text] if option.multiple else text
        with contextlib.suppress(click.UsageError, RollcliError):  # whatever else is raised is the find
            option.type_cast_value(context, given)


@pytest.fixture
def maps(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mute_stderr, "_sink", None)  # set by the runs, and not for this process to keep
    write_maps(tmp_path / "maps", 1, width=64, height=48)


ESTIMATE = [
    flag
    for name, flag in OPTIONS
    if name == "estimate" and not isinstance(option_of(name, flag)[1].type, NO_NUMBERS) and flag != "--jobs"
]


@pytest.mark.parametrize("flag", ESTIMATE)
def test_a_run_with_any_number_ends_with_a_documented_status(maps, flag):
    for text in (each for number in NUMBERS[:16] for each in lists_of(number)[:4]):
        done = CliRunner().invoke(main, ["estimate", "maps", "-q", "-j", "1", f"{flag}={text}"])

        assert done.exception is None or isinstance(done.exception, SystemExit), (text, done.exception)
        assert done.exit_code in tuple(ExitStatus), (text, done.output)
