"""`rollcli simulate`: render stereo pairs whose roll is known."""

from dataclasses import replace

import click

from rollcli.cli.command import command, config_option, option, record
from rollcli.cli.estimate import one_start, resume_command
from rollcli.cli.options import running_options
from rollcli.cli.types import DIR, FLAG, IMAGE_SIZE, POINT, Choice, Number, span
from rollcli.run.options import RunningOptions
from rollcli.simulate.options import (
    CROSS_SECTIONS,
    CROSSFALL,
    FOCAL_PER_WIDTH,
    GUTTER_WIDTH,
    KERB,
    MAX_DIPS,
    MIXED,
    ROUGHNESS,
    SCENES,
    SimulateOptions,
)

simulate_options = record(
    "options",
    "What to render",
    SimulateOptions,
    option("--frames", Number("N", at_least=1, whole=True), "Number of pairs."),
    option(
        "--scene",
        Choice(*SCENES, MIXED),
        "bare: a road alone; open: with kerbs and cars; street: with house fronts too; verge: between "
        "grass slopes; mixed: each frame one of these.",
    ),
    option(
        "--roll",
        span(-90, 90),
        "Roll of the rig against the road, degrees, drawn evenly from A to B; positive: its right end is up.",
    ),
    option(
        "--pitch",
        span(-60, 60),
        "Pitch of the rig against the road, degrees, drawn evenly from A to B; positive: it looks down.",
    ),
    option(
        "--curvature",
        span(-0.01, 0.01),
        "Curvature along the road, 1/m, drawn evenly from A to B; positive: a sag; negative: a crest.  "
        "[default: half of the frames flat, half within +-0.001; bare is flat]",
    ),
    option(
        "--bend",
        span(-0.02, 0.02),
        "Horizontal curvature of the road, 1/m, drawn evenly from A to B; positive: to the right; 0: a "
        "straight road.  [default: half of the roads straight, half within +-0.004; bare is straight]",
    ),
    option(
        "--cross-section",
        Choice(*CROSS_SECTIONS, MIXED),
        "Shape of the road across. crown, dish: a parabola, highest or lowest in the middle; roof: two "
        "planes that meet in the middle; superelevated: one plane, its outer side up in a bend; mixed: each "
        "frame one of these. Roll and pitch are against the plane tangent to the road below the left camera.",
    ),
    option(
        "--crossfall",
        span(0, 15),
        "Slope of a cross section that is not flat, per cent, drawn evenly from A to B; of a crown or "
        f"dish at its edges.  [default: {CROSSFALL[0]:g}:{CROSSFALL[1]:g}]",
    ),
    option(
        "--gutter",
        span(0, 50),
        f"How much more the outer {100 * GUTTER_WIDTH:g} cm on each side fall outward, per cent, drawn "
        "evenly from A to B.",
    ),
    option(
        "--kerb",
        span(0, 0.5),
        "Height of kerbs and pavements (open, street) above the road's edge, metres, drawn evenly from "
        f"A to B.  [default: {KERB[0]:g}:{KERB[1]:g}]",
    ),
    option(
        "--dips",
        Number("N", at_least=0, at_most=MAX_DIPS, whole=True),
        "Dips and bumps of 2.5 to 7 cm in the lane ahead of each road, and DIR/heights: how high the "
        "ground lies over the road, metres, float32 TIFF; 0: kerbs and pavements alone.  [default: neither]",
    ),
    option(
        "--roughness",
        Choice(*ROUGHNESS),
        "Class of the road's unevenness by ISO 8608, along and across, with mended patches and "
        "sunken tracks; A: new asphalt, C: an old road, E: gravel. Roll, pitch and height are against the "
        "plane that fits the lane ahead.  [default: a smooth road]",
    ),
    option("--size", IMAGE_SIZE, "Size of the images, pixels."),
    option(
        "--focal",
        Number("PX", above=0),
        f"Focal length, pixels.  [default: {FOCAL_PER_WIDTH:g} times the width]",
    ),
    option(
        "--principal-point",
        POINT,
        "Column and row of the principal point, pixels from the centre of the top-left pixel.  "
        "[default: the image's centre]",
    ),
    option(
        "--principal-offset",
        span(-16384, 16384),
        "Offset of the principal point in each direction, pixels, drawn evenly from A to B.",
    ),
    option("--baseline", Number("M", above=0), "Distance of the cameras, metres."),
    option(
        "--height",
        span(0.01, 1000),
        "Height of the left camera above the road, metres, drawn evenly from A to B.",
    ),
    option(
        "--noise",
        Number("SIGMA", at_least=0),
        "Noise of the sensor: standard deviation in grey levels of 255.",
    ),
    option("--gain", Number("F", above=0), "Brightness of the right view relative to the left one."),
    option("--grey", FLAG, "Write grey images.  [default: colour]"),
    option(
        "--seed",
        Number("INT", at_least=0, whole=True),
        "Seed of the random numbers; the same seed gives the same files.",
        default=0,
    ),
    option("--resume", FLAG, "Keep the frames of an interrupted simulation and do the rest."),
)


@command(
    examples=[
        (
            "Render, estimate, and compare with the truth",
            "rollcli simulate rig/ --frames 200 --size 1280x720 --focal 700 --baseline 0.3 --height 1.4\n"
            "rollcli estimate --left rig/left --right rig/right -o rig/rolls.csv\n"
            "rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv",
        )
    ]
)
@click.argument("folder", type=DIR, metavar="DIR")
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
