"""`rollcli evaluate accuracy` and `rollcli evaluate paper`."""

from typing import Any

import click

from rollcli.cli.command import command, config_option, option, record
from rollcli.cli.options import encoding_options, input_options, region_options, running_options
from rollcli.cli.types import DIR, FILE, PATH, TABLE_FILE, TABLE_FORMATS, TURNS, Choice, Number, table_format
from rollcli.evaluate.options import AccuracyOptions, ExperimentOptions, PaperOptions


@command(
    short_help="Errors of a result against known angles.",
    examples=[
        (
            "Angles against those of `simulate`",
            "rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv",
        )
    ],
)
@click.argument("result", type=PATH)
@option(
    "--truth",
    FILE,
    "The known angles: CSV with the columns file and roll_deg, degrees.",
    required=True,
    section="Figures",
)
@option(
    "--heights",
    DIR,
    "Heights over the road that estimate wrote, compared with heights/ beside the known angles at 5, 10 "
    "and 20 m.  [default: where the run of RESULT wrote them, if both exist]",
    section="Figures",
)
@option("-o, --output", TABLE_FILE, "Where the figures go (-: stdout).", default="-", section="Figures")
@option(
    "--format",
    Choice(*TABLE_FORMATS),
    "A table to read, or degrees and shares from 0 to 1 for programs.  "
    "[default: by FILE's ending, else table]",
    section="Figures",
)
@running_options
@config_option
@click.pass_context
def accuracy(ctx: click.Context, /, **options: Any) -> None:
    """Compare the angles of RESULT, which estimate wrote, with known ones; its heights over the road, too.

    Frames are matched by the names of their files, without folder and ending. Those without a partner are
    counted on stderr; exit status 3 when a frame of the truth has no angle.
    """
    from rollcli.evaluate.accuracy import run_accuracy

    form = table_format(options.pop("format"), options["output"])
    ctx.exit(run_accuracy(AccuracyOptions(**options, format=form)))


experiment_options = record(
    "experiments",
    "Experiments",
    ExperimentOptions,
    option("-o, --output", DIR, "Where paper.html and its CSVs go.", required=True),
    option("--turns", TURNS, "Rotate each map by these angles, degrees."),
    option(
        "--timed",
        Number("N", at_least=1, whole=True),
        "Take the run times on the first N maps; the paper's n x 3 form is slow.",
    ),
    option(
        "--truth",
        FILE,
        "Known angles of the maps: CSV with file and roll_deg.  [default: each map's own estimate]",
    ),
    option(
        "--figure",
        click.Choice(["svg", "pdf", "png"]),
        "Write each chart of the page as a figure, too, as wide as a journal's column (3.5 inches).",
    ),
)


@command(
    short_help="The paper's tables and figures on your maps.",
    examples=[("The page, and its CSVs", "rollcli evaluate paper maps/ -o paper/")],
)
@input_options
@experiment_options
@encoding_options
@region_options
@running_options
@config_option
@click.pass_context
def paper(ctx: click.Context, /, **records: Any) -> None:
    """Repeat the paper's tables and figures on these maps, and write them as CSV and one HTML page of charts.

    Iterations and run times of golden section and gradient descent (Tables I and II), first learning rates
    from 1 to 100 (Fig. 3), accuracy after known rotations (Fig. 6), and the same for the other methods. Every
    valid pixel is used, as in the paper. The page needs the extra: pip install "rollcli[report]".
    """
    from rollcli.evaluate.paper import run_paper

    ctx.exit(run_paper(PaperOptions(**records)))


@click.group(invoke_without_command=True)
@click.pass_context
def evaluate(ctx: click.Context) -> None:
    """Repeat the paper's experiments on your maps; compare results with known angles."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


evaluate.add_command(accuracy)
evaluate.add_command(paper)
