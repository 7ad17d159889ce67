"""`rollcli evaluate paper`: the paper's experiments on your maps."""

from typing import Any

import click

from rollcli.cli.command import command, option, record
from rollcli.cli.config import config_option
from rollcli.cli.options import PATH, encoding_options, input_options, region_options, running_options
from rollcli.cli.types import Number, ParamType
from rollcli.evaluate.options import TIMED, TURNS_DEG, ExperimentOptions, PaperOptions


class Turns(ParamType):
    """A:B:STEP with A <= B and a step above 0, all within a quarter turn; at most 1000 angles."""

    name = "A:B:STEP"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, float]:
        if isinstance(value, tuple):
            return value  # the default
        try:
            first, last, step = map(float, str(value).split(":"))
        except ValueError:
            first, last, step = 0.0, -1.0, 1.0
        if not (-90 <= first <= last <= 90 and step > 0 and last - first <= 1000 * step):
            self.fail(
                f"{value!r} is not A:B:STEP in degrees with -90 <= A <= B <= 90, such as -20:20:2", param, ctx
            )
        return first, last, step


experiment_options = record(
    "experiments",
    "Experiments",
    ExperimentOptions,
    option(
        "-o", "--output", type=PATH, metavar="DIR", required=True, help="Where paper.html and its CSVs go."
    ),
    option(
        "--turns",
        type=Turns(),
        default=TURNS_DEG,
        show_default=False,
        help="Rotate each map by these angles, degrees.  [default: -20:20:2]",
    ),
    option(
        "--timed",
        type=Number("N", at_least=1, whole=True),
        default=TIMED,
        help="Take the run times on the first N maps; the paper's n x 3 form is slow.",
    ),
    option(
        "--truth",
        type=PATH,
        metavar="FILE",
        help="Known angles of the maps: CSV with file and roll_deg.  [default: each map's own estimate]",
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
    from rollcli.evaluate.run_paper import run_paper

    ctx.exit(run_paper(PaperOptions(**records)))
