"""`rollcli rig`: what the frames of a result say about the rig."""

from dataclasses import replace

import click

from rollcli.cli import options as shared
from rollcli.cli.command import Section, command, option
from rollcli.cli.types import FILE, FLAG, PATH, TABLE_FILE, TABLE_FORMATS, Choice, Number, Text, table_format
from rollcli.errors import ExitStatus
from rollcli.run.options import GateOptions, RigOptions

gate_options = Section(
    "gates", "Checks: exit status 4 when one fails, 5 when none fails and one cannot be told", GateOptions
).of(
    option("--expect-roll", Number("DEG", at_least=-90, at_most=90)),
    option("--expect-pitch", Number("DEG", at_least=-90, at_most=90)),
    option("--expect-height", Number("M")),
    option("--within", Number("DEG", at_least=0)),
    option("--within-height", Number("M", at_least=0)),
    option("--max-drift", Number("DEG", at_least=0)),
    option("--max-jump", Number("DEG", at_least=0)),
    option("--max-misalignment", Number("PX", at_least=0)),
    option("--min-ok", Number("SHARE", at_least=0, at_most=1)),
)


@command(
    RigOptions,
    statuses={
        ExitStatus.DONE: "the rig is assessed, and every check holds",
        ExitStatus.CHECK_FAILED: "at least one check has failed; a line for each says which frames",
        ExitStatus.UNTOLD: ExitStatus.UNTOLD.meaning,
    },
)
@click.argument("results", nargs=-1, required=True, type=PATH)
@option("--against", FILE, section="Assessment")
@option("--include-suspect", FLAG, section="Assessment")
@option("--groups", Text("GLOB|none"), section="Assessment")
@option("-o, --output", TABLE_FILE, section="Assessment")
@option("--format", Choice(*TABLE_FORMATS), default=None, section="Assessment")
@option("--correction", FILE, section="Assessment")
@shared.calibration_options
@gate_options
@shared.running_options
def rig(options: RigOptions) -> int:
    """Say how the rig is mounted, whether it has drifted, and when it has jumped.

    RESULTS are results of `rollcli estimate`, or the shards of one run. Neighbouring frames are alike: the
    95 % intervals allow for as much of that as the frames do, and there is one from 8 frames on. Suspect
    frames are counted and not used. After a jump, the roll is that of the frames since, and with a drift
    that at the end: of the rig as it is now.

    Examples
    --------
    How the rig is mounted, and whether it has moved
        rollcli rig rolls.csv
    A gate for CI: status 4 when the rig has come loose, or when too many maps have no sure angle
        rollcli rig rolls.csv --expect-roll 0 --within 0.5 --max-jump 0.3 --min-ok 0.9
    The shards of one run, in any order
        rollcli rig part1.csv part2.csv part3.csv
    Has it moved since?
        rollcli rig before.csv --against after.csv
    """
    from rollcli.run.rig import run_rig

    return run_rig(replace(options, format=table_format(options.format, options.output)))
