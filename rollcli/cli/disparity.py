"""`rollcli disparity`: compute maps from stereo pairs."""

from typing import Any

import click

from rollcli.cli.command import command, option, tell_idle
from rollcli.cli.config import config_option
from rollcli.cli.options import (
    PATH,
    cluster_options,
    folder_options,
    output_folder_option,
    pair_options,
    save_as_option,
    stereo_options,
)
from rollcli.convert.options import DisparityOptions


@command(
    examples=[
        ("A folder of pairs", "rollcli disparity --left cam/left --right cam/right -o maps/"),
        (
            "At half the size, as floating-point TIFF",
            "rollcli disparity --left 'im0*.png' --right 'im1*.png' --downscale 2 --save-as tiff -o maps/",
        ),
    ],
    instead="images are given by --left and --right",
)
@pair_options
@folder_options
@output_folder_option
@save_as_option
@option(
    "--preview",
    type=PATH,
    metavar="DIR",
    section="Output",
    help="Also write each map as a picture to look at, in colour with a scale in pixels, PNG.",
)
@stereo_options
@cluster_options
@config_option
@click.pass_context
def disparity(ctx: click.Context, /, **records: Any) -> None:
    """Match rectified stereo pairs with OpenCV SGBM: one disparity map a pair, named after the left image.

    Images are PNG, JPEG, TIFF, BMP, PGM or PPM, of 8 or 16 bits, grey or colour. An image without a partner
    is an error that names it, before anything runs.
    """
    from rollcli.convert.disparity import run_disparity
    from rollcli.convert.idle import idle_in_disparity

    options = DisparityOptions(**records)
    tell_idle(ctx, idle_in_disparity(options), quiet=options.running.quiet)
    ctx.exit(run_disparity(options))
