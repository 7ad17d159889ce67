"""`rollcli derotate`: rotate maps."""

from typing import Any

import click

from rollcli.cli.command import command, option, record, tell_idle
from rollcli.cli.config import config_option
from rollcli.cli.options import PATH, cluster_options, encoding_options, input_options, output_folder_option
from rollcli.cli.types import Number
from rollcli.convert.options import DerotateOptions, RotationOptions


def _rotation(*, roll: float | None, **values: Any) -> RotationOptions:
    return RotationOptions(roll_deg=roll, result=values.pop("from"), **values)


rotation_options = record(
    "rotation",
    "Angle",
    _rotation,
    option(
        "--roll",
        type=Number("DEG", at_least=-180, at_most=180),
        help="Of the rig, for every map, degrees; positive: its right end is up.",
    ),
    option(
        "--from",
        type=PATH,
        metavar="RESULT",
        help="The angle of each map, from what `rollcli estimate` wrote; matched by stem.",
    ),
    option("--skip-suspect", is_flag=True, help="With --from, leave out the maps whose angle is suspect."),
    option("--expand", is_flag=True, help="Enlarge the maps so that their corners are kept."),
)


@command(
    examples=[
        ("The angles that estimate found", "rollcli derotate maps/ --from rolls.csv -o upright/"),
        ("One angle for all, nothing cut off", "rollcli derotate maps/ --roll 2.5 --expand -o upright/"),
    ]
)
@input_options
@rotation_options
@output_folder_option
@encoding_options
@cluster_options
@config_option
@click.pass_context
def derotate(ctx: click.Context, /, **records: Any) -> None:
    """Rotate disparity maps by their roll, so that rows of the road become constant.

    INPUTS are maps (PNG, TIFF, NPY, PFM), folders of them, quoted patterns, or - for paths on stdin. A map
    keeps its type, encoding and format. Values are interpolated between valid pixels alone, and what is no
    data stays no data.

    With --from, every map needs its row and every row with an angle its map: what has no partner is an error
    that names it, before anything is written. Suspect angles are used, and a line says how many there are;
    --skip-suspect leaves their maps out.
    """
    from rollcli.convert.derotate import run_derotate
    from rollcli.convert.idle import idle_in_derotate
    from rollcli.frames.idle import repeated_inputs

    options = DerotateOptions(**records)
    tell_idle(ctx, idle_in_derotate(options), repeated_inputs(options.inputs), quiet=options.running.quiet)
    ctx.exit(run_derotate(options))
