"""`rollcli simulate`: render stereo pairs whose roll is known."""

import re
from dataclasses import replace
from typing import Any

import click

from rollcli.cli.command import argument, command, option, record
from rollcli.cli.config import config_option
from rollcli.cli.estimate import one_start, resume_command
from rollcli.cli.options import PATH, running_options
from rollcli.cli.types import Choice, Number, ParamType, Point, Span
from rollcli.run.options import RunningOptions
from rollcli.simulate import options as asked
from rollcli.simulate.options import MIXED, SimulateOptions


class Size(ParamType):
    """WxH in whole pixels."""

    name = "WxH"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return self.name  # click would turn it into capitals

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        found = re.fullmatch(r"(\d{1,6})[xX×](\d{1,6})", str(value))
        if found is None:
            self.fail(f"{value!r} is not WxH in whole pixels, such as 640x480", param, ctx)
        return int(found[1]), int(found[2])


def _options(*, roll: asked.Span | None, pitch: asked.Span | None, **values: Any) -> SimulateOptions:
    """Make the record of what was given; the rest is as the record has it."""
    given = {"roll_deg": roll, "pitch_deg": pitch, **values}
    return SimulateOptions(**{name: value for name, value in given.items() if value is not None})


def _span(ends: asked.Span) -> str:
    return f"  [default: {ends[0]:g}:{ends[1]:g}]"


simulate_options = record(
    "options",
    "What to render",
    _options,
    option(
        "--frames",
        type=Number("N", at_least=1, whole=True),
        default=SimulateOptions.frames,
        help="Number of pairs.",
    ),
    option(
        "--scene",
        type=Choice(*asked.SCENES, MIXED),
        default=SimulateOptions.scene,
        help="bare: a road alone; open: with kerbs and cars; street: with house fronts too; verge: between "
        "grass slopes; mixed: each frame one of these.",
    ),
    option(
        "--roll",
        type=Span(),
        help="Roll of the rig against the road, degrees, drawn evenly from A to B; positive: its right "
        "end is up." + _span(SimulateOptions.roll_deg),
    ),
    option(
        "--pitch",
        type=Span(),
        help="Pitch of the rig against the road, degrees, drawn evenly from A to B; positive: it looks "
        "down." + _span(SimulateOptions.pitch_deg),
    ),
    option(
        "--curvature",
        type=Span(),
        help="Curvature along the road, 1/m, drawn evenly from A to B; positive: a sag; negative: a crest.  "
        "[default: half of the frames flat, half within +-0.001; bare is flat]",
    ),
    option(
        "--bend",
        type=Span(),
        help="Horizontal curvature of the road, 1/m, drawn evenly from A to B; positive: to the right; 0: a "
        "straight road.  [default: half of the roads straight, half within +-0.004; bare is straight]",
    ),
    option(
        "--cross-section",
        type=Choice(*asked.CROSS_SECTIONS, MIXED),
        default=SimulateOptions.cross_section,
        help="Shape of the road across. crown, dish: a parabola, highest or lowest in the middle; roof: two "
        "planes that meet in the middle; superelevated: one plane, its outer side up in a bend; mixed: each "
        "frame one of these. Roll and pitch are against the plane tangent to the road below the left camera.",
    ),
    option(
        "--crossfall",
        type=Span(),
        help="Slope of a cross section that is not flat, per cent, drawn evenly from A to B; of a crown or "
        "dish at its edges." + _span(asked.CROSSFALL),
    ),
    option(
        "--gutter",
        type=Span(),
        help=f"How much more the outer {100 * asked.GUTTER_WIDTH:g} cm on each side fall outward, per cent, "
        "drawn evenly from A to B.  [default: 0]",
    ),
    option(
        "--kerb",
        type=Span(),
        help="Height of kerbs and pavements (open, street) above the road's edge, metres, drawn evenly from "
        "A to B." + _span(asked.KERB),
    ),
    option(
        "--dips",
        type=Number("N", at_least=0, at_most=asked.MAX_DIPS, whole=True),
        help="Dips and bumps of 2.5 to 7 cm in the lane ahead of each road, and DIR/heights: how high the "
        "ground lies over the road, metres, float32 TIFF; 0: kerbs and pavements alone.  [default: neither]",
    ),
    option(
        "--roughness",
        type=Choice(*asked.ROUGHNESS),
        help="Class of the road's unevenness by ISO 8608, along and across, with mended patches and "
        "sunken tracks; A: new asphalt, C: an old road, E: gravel. Roll, pitch and height are against the "
        "plane that fits the lane ahead.  [default: a smooth road]",
    ),
    option(
        "--size",
        type=Size(),
        help="Size of the images, pixels.  [default: {}x{}]".format(*SimulateOptions.size),
    ),
    option(
        "--focal",
        type=Number("PX", above=0),
        help=f"Focal length, pixels.  [default: {asked.FOCAL_PER_WIDTH:g} times the width]",
    ),
    option(
        "--principal-point",
        type=Point(),
        help="Column and row of the principal point, pixels from the centre of the top-left pixel.  "
        "[default: the image's centre]",
    ),
    option(
        "--principal-offset",
        type=Span(),
        help="Offset of the principal point in each direction, pixels, drawn evenly from A to B.  "
        "[default: 0]",
    ),
    option(
        "--baseline",
        type=Number("M", above=0),
        default=SimulateOptions.baseline,
        help="Distance of the cameras, metres.",
    ),
    option(
        "--height",
        type=Span(),
        help="Height of the left camera above the road, metres, drawn evenly from A to B.  "
        f"[default: {SimulateOptions.height[0]:g}]",
    ),
    option(
        "--noise",
        type=Number("SIGMA", at_least=0),
        default=SimulateOptions.noise,
        help="Noise of the sensor: standard deviation in grey levels of 255.",
    ),
    option(
        "--gain",
        type=Number("F", above=0),
        default=SimulateOptions.gain,
        help="Brightness of the right view relative to the left one.",
    ),
    option("--grey", is_flag=True, help="Write grey images.  [default: colour]"),
    option(
        "--seed",
        type=Number("INT", at_least=0, whole=True),
        default=SimulateOptions.seed,
        help="Seed of the random numbers; the same seed gives the same files.",
    ),
    option("--resume", is_flag=True, help="Keep the frames of an interrupted simulation and do the rest."),
)


@command(
    examples=[
        (
            "Render, estimate, and compare with the truth",
            "rollcli simulate rig/ --frames 200 --size 1280x720 --focal 700 --baseline 0.3 --height 1.4\n"
            "rollcli estimate --left rig/left --right rig/right -o rig/rolls.csv\n"
            "rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv",
        ),
    ]
)
@argument("folder", metavar="DIR", type=PATH)
@simulate_options
@running_options
@config_option
@click.pass_context
def simulate(ctx: click.Context, /, folder: str, options: SimulateOptions, running: RunningOptions) -> None:
    """Render road stereo pairs with known roll into DIR.

    Writes DIR/left and DIR/right (8-bit PNG), DIR/disparity (the true disparity of the left view, 16-bit
    KITTI PNG), DIR/calib.txt (the calibration in KITTI's form) and DIR/truth.csv.
    """
    from rollcli.simulate.dataset import run_simulate

    resume, overwrite = one_start(ctx, resume=options.resume, overwrite=running.overwrite)
    options, running = replace(options, resume=resume), running._replace(overwrite=overwrite)
    ctx.exit(run_simulate(folder, options, running, resume_command(ctx)))
