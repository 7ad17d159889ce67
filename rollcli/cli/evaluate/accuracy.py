"""`rollcli evaluate accuracy`: the errors of a result against known angles."""

from typing import Any

import click

from rollcli.cli.command import argument, command, option
from rollcli.cli.config import config_option
from rollcli.cli.options import PATH, running_options
from rollcli.cli.types import Choice
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
    type=PATH,
    metavar="FILE",
    default="-",
    section="Figures",
    help="Where the figures go (-: stdout).",
)
@option(
    "--format",
    type=Choice("table", "csv", "json"),
    default="table",
    section="Figures",
    help="To read, or for programs: degrees, and shares from 0 to 1.",
)
@running_options
@config_option
@click.pass_context
def accuracy(
    ctx: click.Context, /, result: str, truth: str, output: str, running: RunningOptions, **options: Any
) -> None:
    """Compare the angles of RESULT, which estimate wrote, with known ones.

    Frames are matched by the stem of their file. Those without a partner are named on stderr; exit status 3
    when a frame of the truth has no angle.
    """
    from rollcli.evaluate.run_accuracy import run_accuracy

    ctx.exit(run_accuracy(result, truth, options["format"], output, running))
