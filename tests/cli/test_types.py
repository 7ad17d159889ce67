"""Which values each kind of option takes, at its bounds and beyond them; any number ends in one line."""

import contextlib
import math

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rollcli.cli.main import main
from rollcli.cli.types import (
    ANY_NUMBER,
    IMAGE_SIZE,
    POINT,
    POLYGON,
    ROI,
    SHARD,
    SPAN,
    TURNS,
    WIDE_SPAN,
    Choice,
    FilePath,
    Number,
    OutputFile,
    table_format,
)
from rollcli.errors import ExitStatus, RollcliError
from rollcli.files.codecs import png as mute_stderr
from tests.readme_tables import commands
from tests.run_cli import write_maps

POSITIVE, COUNT, WHOLE, SIZE = ("1e-9 1e9", "0 -1"), ("1 9", "0 1.5"), ("0 9", "-1 0.5"), ("0 1e9", "-1e-9")


# by flag: what is taken, and what is refused
BOUNDED = {
    "--part-rows": COUNT,
    "--block-size": COUNT,
    "--jobs": COUNT,
    "--every": COUNT,
    "--frames": COUNT,
    "--timed": COUNT,
    "--num-disparities": ("1 16 auto", "0 1.5 Auto"),
    "--bins": ("1 65535", "0 65536"),  # what a TIFF of 16 bits is wide
    "--seed": WHOLE,
    "--dips": ("0 12", "-1 13 0.5"),
    "--speckle-size": WHOLE,
    "--speckle-range": WHOLE,
    "--gallery": WHOLE,
    "--uniqueness": ("0 100", "-1 101"),  # percent
    "--scale": POSITIVE,
    "--focal": POSITIVE,
    "--baseline": POSITIVE,
    "--gain": POSITIVE,
    "--max-disparity": POSITIVE,
    "--lambda0": ("1e-9 26 auto", "0 -1"),
    "--downscale": ("1 1.5", "0.999"),
    "--tolerance": ("1e-9 90", "0 90.001"),  # an angle has a period of 180 degrees
    "--max-interval": ("1e-9 90", "0 90.001"),
    "--max-roll": ("1e-9 89", "0 89.001"),  # at 90 degrees no row goes downward
    "--roll": ("-180 180", "-180.001 180.001"),
    "--noise": SIZE,
    "--within": SIZE,
    "--within-height": SIZE,
    "--max-drift": SIZE,
    "--max-jump": SIZE,
    "--max-misalignment": SIZE,
    "--sync-tolerance": SIZE,
    "--min-ok": ("0 1", "-0.001 1.001"),  # a share
}


def bounded():
    """(flag, type) of every option that takes a number within bounds."""
    for _, context in commands():
        for each in context.command.params:
            if isinstance(each.type, Number):
                bounds = each.type.above, each.type.at_least, -each.type.at_most
                if each.type.whole or any(map(math.isfinite, bounds)):
                    yield each.opts[-1], each.type


@pytest.mark.parametrize(
    ("flag", "kind"), list(bounded()), ids=lambda each: each if isinstance(each, str) else ""
)
def test_a_number_is_taken_at_its_bounds_and_refused_beyond_them(flag, kind):
    if flag == "--min-disparity":
        taken, refused = "-16 0 16", "0.5"
    else:
        taken, refused = BOUNDED[flag]
    for text in taken.split():
        assert kind.convert(text, None, None) == (text if text == "auto" else float(text))
    for text in (*refused.split(), "nan", "inf", "x", True, None):
        with pytest.raises(click.UsageError):
            kind.convert(text, None, None)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({}, "a number"),
        ({"whole": True, "at_least": 1}, "a whole number of at least 1"),
        ({"above": 0, "at_most": 90, "auto": True}, "a number above 0 and of at most 90 or auto"),
    ],
)
def test_what_is_refused_says_what_is_taken(bounds, words):
    kind = Number("PX", **bounds)
    assert kind.get_metavar(None) == ("PX|auto" if "auto" in bounds else "PX")
    with pytest.raises(click.BadParameter, match=f"^'x' is not {words}$"):
        kind.convert("x", None, None)


def test_a_whole_number_is_one_also_where_it_is_written_as_a_float():
    kind = Number("N", whole=True)
    assert [type(kind.convert(value, None, None)) for value in ("7", 7, 7.0)] == [int] * 3
    assert type(Number("N").convert("7", None, None)) is float
    with pytest.raises(click.BadParameter):
        kind.convert("7.0", None, None)


CORNERS = "'0,375 600,180 1242,375'"


@pytest.mark.parametrize(
    ("kind", "given", "expected"),
    [
        (ROI, "0,1,2,3", (0, 1, 2, 3)),
        (ROI, " 0 , 1 , 2,3 ", (0, 1, 2, 3)),
        (ROI, [0, 1, 2, 3], (0, 1, 2, 3)),
        (ROI, "2,0,2,3", "is not X0,Y0,X1,Y1"),
        (ROI, "0,3,2,3", "is not X0,Y0,X1,Y1"),
        (ROI, "0,1,2", "is not X0,Y0,X1,Y1"),
        (ROI, "0,1,2,3.5", "is not X0,Y0,X1,Y1"),
        (POINT, "609.6,172.9", (609.6, 172.9)),
        (POINT, (1, 2), (1.0, 2.0)),
        (POINT, "1", "is not CX,CY"),
        (POINT, "1,2,3", "is not CX,CY"),
        (POINT, "1,inf", "is not CX,CY"),
        (POLYGON, "0,0 4,0 0,3.5", ((0, 0), (4, 0), (0, 3.5))),
        (POLYGON, [[0, 0], [4, 0], [0, 3.5]], ((0, 0), (4, 0), (0, 3.5))),
        (POLYGON, "0,0 4,0", f"is not three or more corners such as {CORNERS}"),
        (POLYGON, "0,0 4,0 3", "is not three or more corners"),
        (POLYGON, "0,0 4,0 1,2,3", "is not three or more corners"),
        (POLYGON, "0,0 4,0 1,nan", "is not three or more corners"),
        (POLYGON, 5, "is not three or more corners"),
        (SHARD, "1/1", (1, 1)),
        (SHARD, "8/8", (8, 8)),
        (SHARD, "0/8", "is not I/N"),
        (SHARD, "9/8", "is not I/N"),
        (SHARD, "1", "is not I/N"),
        (ANY_NUMBER, "nan", math.nan),
        (ANY_NUMBER, "-inf", -math.inf),
        (ANY_NUMBER, True, "True is not a number"),
        (ANY_NUMBER, "x", "'x' is not a number"),
        (TURNS, "-90:90:0.5", (-90, 90, 0.5)),
        (TURNS, "5:5:1", (5, 5, 1)),
        (TURNS, "0:1000:1", "is not A:B:STEP"),
        (TURNS, "-90.1:0:1", "is not A:B:STEP"),
        (TURNS, "0:90.1:1", "is not A:B:STEP"),
        (TURNS, "2:1:1", "is not A:B:STEP"),
        (TURNS, "0:1:0", "is not A:B:STEP"),
        (TURNS, "0:10:0.01", (0, 10, 0.01)),  # a thousand steps
        (TURNS, "0:10.02:0.01", "is not A:B:STEP"),
        (TURNS, "1:2", "is not A:B:STEP"),
        (FilePath(), "", "the name is empty"),
        (FilePath(), "a", "a"),
        (OutputFile((".csv",), "CSV"), "a.JSON", r"'a.JSON': \.json is not written here; write CSV"),
        (OutputFile((".csv",), "CSV"), "a.CSV", "a.CSV"),
        (OutputFile((".csv",), "CSV"), "a.txt", "a.txt"),
        (Choice("gd", "gss"), "GSS", "gss"),
        (SPAN, "-5:5.5", (-5, 5.5)),
        (SPAN, "2", (2, 2)),
        (WIDE_SPAN, "-0.1:0.1", (-0.1, 0.1)),
        (WIDE_SPAN, "0:0", "is not A:B with A < B"),
        (WIDE_SPAN, "0.1", "is not A:B with A < B"),
        (SPAN, "2:2", (2, 2)),
        (SPAN, (1.0, 2.0), (1, 2)),
        (SPAN, "2:1", "is not A:B with A <= B"),
        (SPAN, "1:2:3", "is not A:B with A <= B"),
        (SPAN, "1:nan", "is not A:B with A <= B"),
        (SPAN, "", "is not A:B with A <= B"),
        (IMAGE_SIZE, "640x480", (640, 480)),
        (IMAGE_SIZE, "1X2", (1, 2)),
        (IMAGE_SIZE, (3, 4), (3, 4)),
        (IMAGE_SIZE, "640", "is not WxH"),
        (IMAGE_SIZE, "640x480x3", "is not WxH"),
        (IMAGE_SIZE, "-640x480", "is not WxH"),
    ],
)
def test_what_is_given_is_read_or_refused_with_an_example(kind, given, expected):
    if isinstance(expected, str) and " " in expected:
        with pytest.raises(click.UsageError, match=expected):
            kind.convert(given, None, None)
    else:
        np.testing.assert_equal(kind.convert(given, None, None), expected)


def test_a_table_has_the_format_given_else_that_of_its_ending():
    assert [table_format(None, name) for name in ("a.csv", "A.JSON", "a.txt", "-", "table")] == [
        *("csv", "json", "table", "table", "table")
    ]
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
