"""`rollcli simulate`: render stereo pairs whose roll is known."""

from dataclasses import replace

import click

from rollcli.cli import options as shared
from rollcli.cli.command import Section, command, option
from rollcli.cli.estimate import one_start, resume_command
from rollcli.cli.types import DIR, FLAG, IMAGE_SIZE, POINT, Choice, Number, span
from rollcli.run.options import RunningOptions
from rollcli.simulate.options import CROSS_SECTIONS, MAX_DIPS, MIXED, ROUGHNESS, SCENES, SimulateOptions

simulate_options = Section("options", "What to render", SimulateOptions).of(
    option("--frames", Number("N", at_least=1, whole=True)),
    option("--scene", Choice(*SCENES, MIXED)),
    option("--roll", span(-90, 90)),
    option("--pitch", span(-60, 60)),
    option("--curvature", span(-0.01, 0.01)),
    option("--bend", span(-0.02, 0.02)),
    option("--cross-section", Choice(*CROSS_SECTIONS, MIXED)),
    option("--crossfall", span(0, 15)),
    option("--gutter", span(0, 50)),
    option("--kerb", span(0, 0.5)),
    option("--dips", Number("N", at_least=0, at_most=MAX_DIPS, whole=True)),
    option("--roughness", Choice(*ROUGHNESS)),
    option("--size", IMAGE_SIZE),
    option("--focal", Number("PX", at_least=1, at_most=1e6)),
    option("--principal-point", POINT),
    option("--principal-offset", span(-16384, 16384)),
    option("--baseline", Number("M", above=0, at_most=1000)),
    option("--height", span(0.01, 1000)),
    option("--noise", Number("SIGMA", at_least=0, at_most=255)),
    option("--gain", Number("F", above=0, at_most=1000)),
    option("--grey", FLAG),
    option("--seed", Number("INT", at_least=0, whole=True)),
    option("--resume", FLAG),
)


@command()
@click.argument("folder", type=DIR, metavar="DIR")
@simulate_options
@shared.running_options
def simulate(folder: str, options: SimulateOptions, running: RunningOptions) -> int:
    """Render road stereo pairs with known roll into DIR.

    Writes DIR/left and DIR/right (8-bit PNG), DIR/disparity (the true disparity of the left view, 16-bit
    KITTI PNG), DIR/calib.txt (the calibration in KITTI's form; with --principal-offset DIR/calib, a file a
    frame) and DIR/truth.csv.

    Examples
    --------
    Render, estimate, and compare with the truth
        rollcli simulate rig/ --frames 200 --size 1280x720 --focal 700 --baseline 0.3 --height 1.4
        rollcli estimate --left rig/left --right rig/right -o rig/rolls.csv
        rollcli evaluate accuracy rig/rolls.csv --truth rig/truth.csv
    """
    from rollcli.simulate.dataset import run_simulate

    ctx = click.get_current_context()
    resume, overwrite = one_start(ctx, resume=options.resume, overwrite=running.overwrite)
    options, running = replace(options, resume=resume), running._replace(overwrite=overwrite)
    return run_simulate(folder, options, running, resume_command(ctx))
