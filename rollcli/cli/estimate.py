"""`rollcli estimate`: the main job, with what an existing result allows."""

import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
from click.core import ParameterSource

from rollcli.cli import options as shared
from rollcli.cli.command import Needs, Section, command, option
from rollcli.cli.types import FLAG, SHARD, Choice, Number, OutputFile
from rollcli.messages import without_secrets
from rollcli.run.options import EstimateOptions, ResultOptions

_STARTS = ("--overwrite", "--resume", "--update")
_NEAREST_FIRST = [ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT, ParameterSource.DEFAULT_MAP]


def one_start(ctx: click.Context, *, resume: bool, overwrite: bool) -> tuple[bool, bool]:
    """Decide between --resume, --update and --overwrite: flags win over the environment, that over --config.

    Returns
    -------
    tuple of bool
        (resume, overwrite); both where both are given in the same place, which is an error later.
    """
    if not (resume and overwrite):
        return resume, overwrite
    near: dict[ParameterSource | None, int] = {each: place for place, each in enumerate(_NEAREST_FIRST)}
    sources = map(ctx.get_parameter_source, ("resume", "update", "overwrite"))
    to_resume, to_update, to_overwrite = (near.get(source, len(near)) for source in sources)
    to_resume = min(to_resume, to_update)
    return to_resume <= to_overwrite, to_overwrite <= to_resume


def resume_command(ctx: click.Context) -> str:
    """Make a command that can be pasted into any shell: settings from the environment become options."""
    import shlex  # here: every --help imports this module

    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    options = [word for word in words[:end] if word not in _STARTS]
    start = "--update" if ctx.params.get("update") else "--resume"
    called = sys.argv[0]  # by its path where the shell would not find it
    program = called if Path(called).name == "rollcli" and not shutil.which("rollcli") else "rollcli"
    line = [program, *options, *_from_environment(ctx), start, *words[end:]]
    shown = [without_secrets(word) for word in line]
    reads_stdin = "-" in (*(ctx.params.get("inputs") or ()), ctx.params.get("files_from"))
    hints = ["with the same list on stdin"] if reads_stdin else []
    hints += ["with the signed addresses"] if shown != line else []
    return shlex.join(shown) + ("  # " + " and ".join(hints) if hints else "")


def _from_environment(ctx: click.Context) -> Iterator[str]:
    for param in ctx.command.params:
        flag = param.opts[-1]
        if ctx.get_parameter_source(str(param.name)) is not ParameterSource.ENVIRONMENT or flag in _STARTS:
            continue
        value = param.value_from_envvar(ctx)
        if isinstance(param, click.Option) and param.is_flag:
            yield from [flag] if param.type_cast_value(ctx, value) else []
        else:
            for text in value if isinstance(value, list | tuple) else [value]:
                yield from (flag, str(text))


_RESULT_FILE = OutputFile(
    (".csv", ".jsonl", ".ndjson", ".parquet"), "CSV (.csv), JSON Lines (.jsonl) or Parquet (.parquet)"
)
# what options need to have an effect
_PARTS = Needs(
    lambda ctx: ResultOptions(ctx.params["output"], ctx.params["format"]).in_parts,
    "only Parquet and results in an object store have parts",
)
_SHARDS = Needs(lambda ctx: ctx.params["shard"] != (1, 1), "all frames are one shard")

result_options = Section("result", "Result", ResultOptions).of(
    option("-o, --output", _RESULT_FILE),
    option("--format", Choice("csv", "jsonl", "parquet")),
    option("--part-rows", Number("N", at_least=1, whole=True), _PARTS),
    option("--resume", FLAG),
    option("--update", FLAG),
    option("--retry-failed", FLAG),
    option("--shard", SHARD),
    option("--shard-by", Choice("every", "range"), _SHARDS),
    option("--fail-fast", FLAG),
    option("--timing", FLAG),
)


@command(EstimateOptions)
@shared.input_options
@shared.pair_options
@shared.topic_options
@result_options
@shared.image_options
@shared.encoding_options
@shared.region_options
@shared.calibration_options
@shared.cluster_options
@shared.method_options
@shared.stereo_options
def estimate(options: EstimateOptions) -> int:
    """Estimate the roll angle of each disparity map or stereo pair, one row a frame.

    \b
    To start with:
      rollcli estimate maps/ -o rolls.csv
      rollcli estimate --left left/ --right right/ -o rolls.csv
      rollcli report rolls.csv -o rolls.html

    INPUTS are maps (PNG, TIFF, NPY, NPZ, PFM, EXR), folders, .zip and .tar of them, quoted patterns, or - for
    paths on stdin; bags; with --side-by-side images and videos that hold both views.

    A positive roll means that the rig is rolled counter-clockwise seen from behind: its right end is up.

    Examples
    --------
    A folder of maps
        rollcli estimate maps/ -o rolls.csv
    Stereo pairs, with the maps turned upright and their v-disparity images
        rollcli estimate --left left --right right -o rolls.csv --derotated upright/ --vdisparity vdisparity/
    Go on where an interrupted run has stopped
        rollcli estimate maps/ -o rolls.csv --resume
    Do what is new or has changed since
        rollcli estimate maps/ -o rolls.csv --update
    Another program's list of files, angles to yet another one
        find . -name '*_disp.png' | rollcli estimate - | sort -t, -gk4
    Pitch and camera height too, with a calibration file of each frame
        rollcli estimate --left image_0 --right image_1 --calib calib/ -o pose.csv
    A video that holds both views
        rollcli estimate drive.mp4 --side-by-side -o rolls.csv
    The paper's setting: every pixel is road
        rollcli estimate crops/ --road all --method gd -o rolls.csv
    """
    ctx, result = click.get_current_context(), options.result
    resume = result.resume or result.update
    resume, overwrite = one_start(ctx, resume=resume, overwrite=options.running.overwrite)
    options = replace(
        options,
        result=result._replace(resume=resume, update=resume and result.update),
        running=options.running._replace(overwrite=overwrite),
    )

    from rollcli.run.estimate import run_estimate

    return run_estimate(options, resume_command=resume_command(ctx))
