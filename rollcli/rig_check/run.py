"""`rollcli rig` from the command line: what is read and written, and the exit status."""

from collections.abc import Iterable

from rollcli.errors import ExitStatus, UsageError
from rollcli.files.stream import is_stream, write_output
from rollcli.frames.checks import check_writes, list_files
from rollcli.messages import say
from rollcli.rig.assess import RigAssessment, assess_frames, difference
from rollcli.rig.quantities import QUANTITIES, ROLL
from rollcli.rig.sequence.blocks import Estimate
from rollcli.rig.words import findings
from rollcli.rig_check.gates import check_options, run_checks
from rollcli.rig_check.options import RigOptions
from rollcli.rig_check.sources import Source, read_source
from rollcli.rig_check.text import FORMATS, Findings


def run_rig(options: RigOptions) -> int:
    """Assess the rig of a result, and check it.

    Parameters
    ----------
    options : RigOptions

    Returns
    -------
    int
        The exit status: 4 when a check fails.

    Raises
    ------
    UsageError, InputError
        Exit status 2: a file is not what it should be, or shards are missing.
    OutputError
        Exit status 1.
    """
    reads = [*options.results, *filter(None, [options.against])]
    writes = [] if is_stream(options.output) else [options.output]
    if len(set(reads)) < len(reads):
        raise UsageError(f"{next(each for each in reads if reads.count(each) > 1)}: is named twice")
    check_options(options.gates)
    check_writes(reads, writes, overwrite=options.running.overwrite)
    if options.running.dry_run:
        list_files([(reads, writes)])
        return 0
    source = read_source(options.results)
    rig = _assessed(source, options)
    later = None if options.against is None else read_source([options.against])
    after = None if later is None else _assessed(later, options)
    changes = {} if after is None else _changes(rig, after)
    missing = source.missing or (later.missing if later is not None else "")
    checks = run_checks(rig, options.gates, missing, changes.get(ROLL.name))
    found = Findings(rig, checks, after, changes)
    write_output(options.output, FORMATS[options.format](found).encode("utf-8", "surrogateescape"))
    if not options.running.quiet:
        for each in filter(None, [source, later]):
            _tell(each)
        if options.format != "table" or writes:
            _say(findings(rig))
    _say(check.message for check in checks if not check.ok or check.close)
    return 0 if all(check.ok for check in checks) else ExitStatus.CHECK_FAILED


def _assessed(source: Source, options: RigOptions) -> RigAssessment:
    return assess_frames(source.frames, include_suspect=options.include_suspect, groups=options.groups)


def _changes(before: RigAssessment, after: RigAssessment) -> dict[str, Estimate]:
    return {each.name: difference(before.now(each), after.now(each)) for each in QUANTITIES}


def _tell(source: Source) -> None:
    """Say what is to be known about where the frames are from."""
    _say(filter(None, [*source.notes, source.missing]))


def _say(lines: Iterable[str]) -> None:
    """One line each on stderr."""
    for line in lines:
        say(line)
