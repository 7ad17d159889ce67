"""`rollcli evaluate`: accuracy against known angles, and the paper's experiments."""

from typing import Any

import click

from rollcli.batch.options import RunningOptions
from rollcli.cli.command import Command, option
from rollcli.cli.options import PATH, running_options


@click.group(invoke_without_command=True)
@click.pass_context
def evaluate(ctx: click.Context) -> None:
    """The paper's experiments on your maps; accuracy against known angles."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


@evaluate.command(cls=Command)
@click.argument("result", type=PATH)
@option(
    "--truth",
    type=PATH,
    metavar="FILE",
    required=True,
    help="The known angles: CSV with the columns file and roll_deg, degrees.",
)
@option("-o", "--output", type=PATH, metavar="FILE", default="-", help="Where the figures go (-: stdout).")
@option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "json"]),
    default="table",
    help="To read, or for programs: degrees, and shares from 0 to 1.",
)
@running_options
@click.pass_context
def accuracy(
    ctx: click.Context, /, result: str, truth: str, output: str, form: str, running: RunningOptions, **_: Any
) -> None:
    """How far the angles of RESULT, which estimate wrote, are from known ones.

    Frames are matched by the stem of their file. Those without a partner are named on stderr; exit status 3
    when a frame of the truth has no angle.

    \b
    rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv
    """
    from rollcli.evaluate.run import run_accuracy

    ctx.exit(run_accuracy(result, truth, form, output, running))
