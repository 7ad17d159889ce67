"""`rollcli heights`: heights over the road."""

from typing import Any

import click

from rollcli.cli.command import command, option, tell_idle
from rollcli.cli.config import config_option
from rollcli.cli.options import (
    PATH,
    calibration_options,
    cluster_options,
    encoding_options,
    heights_range_option,
    input_options,
    output_folder_option,
)
from rollcli.cli.types import Choice
from rollcli.run.options import HeightsOptions


@command(
    examples=[
        (
            "Heights in metres over the roads that estimate found, with pictures",
            "rollcli estimate maps/ --calib calib.txt -o rolls.csv\n"
            "rollcli heights maps/ --from rolls.csv --calib calib.txt -o heights/ --preview pictures/",
        ),
        ("At once, of stereo pairs too", "rollcli estimate maps/ -o rolls.csv --heights heights/"),
    ]
)
@input_options
@option(
    "--from",
    type=PATH,
    metavar="RESULT",
    required=True,
    section="Road",
    help="The road of each map, from what `rollcli estimate` wrote; matched by stem.",
)
@option("--skip-suspect", is_flag=True, section="Road", help="Leave out the maps whose angle is suspect.")
@output_folder_option
@option(
    "--preview",
    type=PATH,
    metavar="DIR",
    section="Output",
    help="Also write pictures of the heights, PNG, every frame in the same colours.",
)
@heights_range_option
@option(
    "--save-as",
    type=Choice("tiff", "npy"),
    default="tiff",
    section="Output",
    help="float32 TIFF, whose description names the unit, or float32 NPY.",
)
@encoding_options
@calibration_options
@cluster_options
@config_option
@click.pass_context
def heights(ctx: click.Context, /, **options: Any) -> None:
    """Write how high each pixel of disparity maps lies over the road.

    INPUTS are maps (PNG, TIFF, NPY, NPZ, PFM, EXR), folders, .zip and .tar of them, quoted
    patterns, or - for paths on stdin. Heights
    are along the road's normal, over the parabola, roll and camber that RESULT has for each map; positive:
    above the road; NaN: no disparity. They are metres with a calibration that has a baseline, else camera
    heights.

    Every map needs its row and every row with an angle its map: what has no partner is an error that names
    it, before anything is written. Suspect angles are used, and a line says how many there are;
    --skip-suspect leaves their maps out.
    """
    from rollcli.run.heights import run_heights
    from rollcli.run.unused import idle_in_heights, repeated_inputs

    given = HeightsOptions(result=options.pop("from"), **options)
    tell_idle(ctx, idle_in_heights(given), repeated_inputs(given.inputs), quiet=given.running.quiet)
    ctx.exit(run_heights(given))
