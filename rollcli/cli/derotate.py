"""`rollcli derotate`: maps turned upright."""

from typing import Any

import click

from rollcli.cli.command import command, option, record
from rollcli.cli.config import config_option
from rollcli.cli.options import PATH, encoding_options, input_options, output_folder_option, running_options
from rollcli.cli.types import Number
from rollcli.convert.options import DerotateOptions, TurnOptions


def _turn(*, roll: float | None, **values: Any) -> TurnOptions:
    return TurnOptions(roll_deg=roll, result=values.pop("from"), **values)


turn_options = record(
    "turn",
    "Angle",
    _turn,
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
    option("--expand", is_flag=True, help="Enlarge the maps so that their corners are kept."),
)


@command(
    examples=[
        ("The angles that estimate found", "rollcli derotate maps/ --from rolls.csv -o upright/"),
        ("One angle for all, nothing cut off", "rollcli derotate maps/ --roll 2.5 --expand -o upright/"),
    ]
)
@input_options
@turn_options
@output_folder_option
@encoding_options
@running_options
@config_option
@click.pass_context
def derotate(ctx: click.Context, /, **records: Any) -> None:
    """Rotate disparity maps by their roll, so that rows of the road become constant.

    INPUTS are maps (PNG, TIFF, NPY, PFM), folders of them, quoted patterns, or - for paths on stdin. A map
    keeps its type, encoding and format. Values are interpolated between valid pixels alone, and what is no
    data stays no data.

    With --from, every map needs its row and every row with an angle its map: what has no partner is an error
    that names it, before anything is written.
    """
    from rollcli.convert.derotate import derotate_maps

    ctx.exit(derotate_maps(DerotateOptions(**records)))
