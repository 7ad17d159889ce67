"""`rollcli evaluate accuracy`: the errors of a result against known angles."""

from typing import Any

import click

from rollcli.cli.command import argument, command, option
from rollcli.cli.config import config_option
from rollcli.cli.options import PATH, running_options
from rollcli.cli.types import TABLE_FILE, TABLE_FORMATS, Choice, table_format
from rollcli.frames.options import RunningOptions


@command(
    short_help="Errors of a result against known angles.",
    examples=[
        (
            "Angles against those of `simulate`",
            "rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv",
        )
    ],
)
@argument("result", type=PATH)
@option(
    "--truth",
    type=PATH,
    metavar="FILE",
    required=True,
    section="Figures",
    help="The known angles: CSV with the columns file and roll_deg, degrees.",
)
@option(
    "-o",
    "--output",
    type=TABLE_FILE,
    metavar="FILE",
    default="-",
    section="Figures",
    help="Where the figures go (-: stdout).",
)
@option(
    "--format",
    type=Choice(*TABLE_FORMATS),
    section="Figures",
    help="A table to read, or degrees and shares from 0 to 1 for programs.  "
    "[default: by FILE's ending, else table]",
)
@running_options
@config_option
@click.pass_context
def accuracy(
    ctx: click.Context, /, result: str, truth: str, output: str, running: RunningOptions, **options: Any
) -> None:
    """Compare the angles of RESULT, which estimate wrote, with known ones.

    Frames are matched by the names of their files, without folder and ending. Those without a partner are
    counted on stderr; exit status 3 when a frame of the truth has no angle.
    """
    from rollcli.evaluate.run_accuracy import run_accuracy

    ctx.exit(run_accuracy(result, truth, table_format(options["format"], output), output, running))
