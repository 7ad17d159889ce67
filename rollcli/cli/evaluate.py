"""`rollcli evaluate accuracy` and `rollcli evaluate paper`."""

from dataclasses import replace

import click

from rollcli.cli import options as shared
from rollcli.cli.command import command, option
from rollcli.cli.types import DIR, FILE, PATH, TABLE_FILE, TABLE_FORMATS, TURNS, Choice, Number, table_format
from rollcli.evaluate.options import AccuracyOptions, PaperOptions


@command(AccuracyOptions, short_help="Errors of a result against known angles.")
@click.argument("result", type=PATH)
@option("--truth", FILE, required=True, section="Figures")
@option("--heights", DIR, section="Figures")
@option("-o, --output", TABLE_FILE, default="-", section="Figures")
@option("--format", Choice(*TABLE_FORMATS), section="Figures")
@shared.running_options
def accuracy(options: AccuracyOptions) -> int:
    """Compare the angles of RESULT, which estimate wrote, with known ones; its heights over the road, too.

    Frames are matched by the names of their files, without folder and ending. Those without a partner are
    counted on stderr; exit status 3 when a frame of the truth has no angle. An uneven lane has no one roll:
    with the columns lane_lo_deg and lane_hi_deg, an interval that reaches this range is right.

    Examples
    --------
    Angles against those of `simulate`
        rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv
    """
    from rollcli.evaluate.accuracy import run_accuracy

    return run_accuracy(replace(options, format=table_format(options.format, options.output)))


@command(PaperOptions, short_help="The paper's tables and figures on your maps.")
@shared.input_options
@option("-o, --output", DIR, required=True, section="Experiments")
@option("--turns", TURNS, section="Experiments")
@option("--timed", Number("N", at_least=1, whole=True), section="Experiments")
@option("--truth", FILE, section="Experiments")
@option("--figure", Choice("svg", "pdf", "png"), section="Experiments")
@shared.encoding_options
@shared.region_options
@shared.running_options
def paper(options: PaperOptions) -> int:
    """Repeat the paper's tables and figures on these maps, and write them as CSV and one HTML page of charts.

    Iterations and run times of golden section and gradient descent (Tables I and II), first learning rates
    from 1 to 100 (Fig. 3), accuracy after known rotations (Fig. 6), and the same for the other methods. Every
    valid pixel is used, as in the paper. The page needs the extra: pip install "rollcli[report]".

    Examples
    --------
    The page, and its CSVs
        rollcli evaluate paper maps/ -o paper/
    """
    from rollcli.evaluate.paper import run_paper

    return run_paper(options)


@click.group(invoke_without_command=True)
@click.pass_context
def evaluate(ctx: click.Context) -> None:
    """Repeat the paper's experiments on your maps; compare results with known angles."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


evaluate.add_command(accuracy)
evaluate.add_command(paper)
