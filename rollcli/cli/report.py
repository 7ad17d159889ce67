"""`rollcli report`: make an HTML page of a result."""

import click

from rollcli.cli import options as shared
from rollcli.cli.command import Needs, command, option
from rollcli.cli.types import DIR, FLAG, PATH, Number, OutputFile, Text
from rollcli.errors import ExitStatus
from rollcli.report.options import ReportOptions

_PAGE = Needs(lambda ctx: ctx.params["output"], "only a page has pictures: name one with -o")


@command(
    ReportOptions,
    statuses={
        ExitStatus.DONE: "the page and the charts are written",
        ExitStatus.FRAMES_FAILED: "they are written, and pictures of at least one frame cannot be made",
    },
)
@click.argument("results", nargs=-1, required=True, type=PATH)
@option("-o, --output", OutputFile((".html", ".htm"), "a page (.html)"), section="Page", metavar="FILE.html")
@option("--title", Text("TEXT"), section="Page")
@option("--images", DIR, section="Page")
@option("--gallery", Number("N", at_least=0, whole=True), _PAGE, section="Page")
@option("--fetch", FLAG, _PAGE, section="Page")
@option("--svg", DIR, section="Charts for slides")
@option("--pdf", DIR, section="Charts for slides")
@option("--png", DIR, section="Charts for slides")
@shared.running_options
def report(options: ReportOptions) -> int:
    """Make an HTML page of RESULTS, which `rollcli estimate` wrote: one, several, or the shards of one run.

    It shows the roll over the frames with its 95 % interval, suspect and failed frames marked; how often
    each roll occurs; a summary; and a gallery of maps before and after de-rotation, with v-disparity and
    heights over the road. One file that opens from disk without a network.

    Inputs are looked for under the names that RESULTS give them, from here or from their folder; remote ones
    only where their result lies on the same server or in the same bucket, or with --fetch. This command needs
    the extra: pip install "rollcli[report]".

    Examples
    --------
    A page from a result; pictures are made from the maps that it names
        rollcli report rolls.csv -o rolls.html
    Pictures as estimate wrote them
        rollcli estimate maps/ -o out/rolls.csv --derotated out/upright --vdisparity out/vdisparity
        rollcli report out/rolls.csv --images out -o out/rolls.html
    Several drives, or the shards of one run
        rollcli report monday.csv tuesday.csv -o both.html
    Its charts for slides, without a page
        rollcli report rolls.csv --svg slides --png slides
    """
    from rollcli.report.run import run_report

    return run_report(options)
