"""`rollcli vdisparity`: draw the histogram of each row's disparities."""

from typing import Any

import click

from rollcli.cli.calibration_options import calibration_options
from rollcli.cli.command import command, option, record, tell_idle
from rollcli.cli.config import config_option
from rollcli.cli.options import cluster_options, encoding_options, input_options, output_folder_option
from rollcli.cli.types import Number
from rollcli.convert.options import CountOptions, VDisparityOptions

count_options = record(
    "count",
    "Counting",
    CountOptions,
    option(
        "--bins",
        type=Number("N", at_least=1, at_most=65535, whole=True),
        help="Columns of the histogram.  [default: one a pixel of disparity for maps of whole pixels, else "
        "four; 256 to 1024]",
    ),
    option(
        "--max-disparity",
        type=Number("PX", above=0),
        help="Right end of the histogram, pixels; its last bin also holds what lies beyond.  "
        "[default: just above the map's largest]",
    ),
    option(
        "--counts",
        is_flag=True,
        help="Write the counts too, as a 32-bit TIFF beside the picture; a row sums to its valid pixels.",
    ),
)


@command(
    examples=[
        ("Pictures to look at", "rollcli vdisparity maps/ -o vdisparity/"),
        ("Counts to compute with", "rollcli vdisparity maps/ --counts --max-disparity 128 -o vdisparity/"),
    ]
)
@input_options
@count_options
@output_folder_option
@encoding_options
@calibration_options
@cluster_options
@config_option
@click.pass_context
def vdisparity(ctx: click.Context, /, **records: Any) -> None:
    """Draw the v-disparity image of each map: the histogram of each row's disparities.

    INPUTS are maps (PNG, TIFF, NPY, PFM), folders of them, quoted patterns, or - for paths on stdin. The
    picture is an 8-bit PNG on a log scale; its first rows are those of the map. The map is taken as it is,
    whereas `estimate --vdisparity` rotates it upright first. Where a road is found, its disparity along the
    middle column is drawn as a dashed curve: on a de-rotated map the road's pixels lie on it. With a
    calibration, the road's horizon on that column is drawn, too.
    """
    from rollcli.convert.idle import idle_in_vdisparity
    from rollcli.convert.vdisparity import run_vdisparity
    from rollcli.frames.idle import repeated_inputs

    options = VDisparityOptions(**records)
    tell_idle(ctx, idle_in_vdisparity(options), repeated_inputs(options.inputs), quiet=options.running.quiet)
    ctx.exit(run_vdisparity(options))
