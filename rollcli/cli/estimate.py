"""`rollcli estimate`: the main job."""

from typing import Any

import click

from rollcli.batch.options import EstimateOptions, ResultOptions
from rollcli.cli.calibration_options import calibration_options
from rollcli.cli.command import command, option, record, tell_idle
from rollcli.cli.config import config_option
from rollcli.cli.options import (
    cluster_options,
    encoding_options,
    image_options,
    input_options,
    method_options,
    pair_options,
    region_options,
    stereo_options,
)
from rollcli.cli.resume import one_start, resume_command
from rollcli.cli.types import Choice, Number, OutputFile, Shard

result_options = record(
    "result",
    "Result",
    ResultOptions,
    option(
        "-o",
        "--output",
        type=OutputFile(
            (".csv", ".jsonl", ".ndjson", ".parquet"),
            "CSV (.csv), JSON Lines (.jsonl) or Parquet (.parquet)",
        ),
        metavar="FILE",
        default="-",
        help="Where the rows go (-: stdout).",
    ),
    option(
        "--format",
        type=Choice("csv", "jsonl", "parquet"),
        help="CSV, JSON Lines, or Parquet (a folder of parts).  [default: by FILE's ending, else csv]",
    ),
    option(
        "--part-rows",
        type=Number("N", at_least=1, whole=True),
        default=ResultOptions().part_rows,
        help="Rows of each part, of Parquet and of results in an object store.",
    ),
    option("--resume", is_flag=True, help="Keep the rows of an interrupted run and do the rest."),
    option(
        "--retry-failed",
        is_flag=True,
        help="With --resume: do the frames again whose rows are error, such as those of files mended since.",
    ),
    option(
        "--shard",
        type=Shard(),
        default=(1, 1),
        show_default=False,
        help="Take every N-th frame from the I-th.  [default: 1/1]",
    ),
    option("--fail-fast", is_flag=True, help="Stop at the first frame that fails."),
    option("--timing", is_flag=True, help="Add the column elapsed_ms: milliseconds spent on the frame."),
)


@command(
    examples=[
        ("A folder of maps", "rollcli estimate maps/ -o rolls.csv"),
        (
            "Stereo pairs, with the maps turned upright and their v-disparity images",
            "rollcli estimate --left cam/left --right cam/right -o rolls.csv --derotated upright/ "
            "--vdisparity vdisparity/",
        ),
        ("Go on where an interrupted run has stopped", "rollcli estimate maps/ -o rolls.csv --resume"),
        (
            "Another program's list of files, angles to yet another one",
            "find . -name '*_disp.png' | rollcli estimate - | sort -t, -gk4",
        ),
        (
            "Pitch and camera height too, with a calibration file of each frame",
            "rollcli estimate --left image_0 --right image_1 --calib calib/ -o pose.csv",
        ),
        (
            "The paper's setting: every pixel is road",
            "rollcli estimate crops/ --road all --method gd -o rolls.csv",
        ),
    ]
)
@input_options
@pair_options
@result_options
@image_options
@encoding_options
@region_options
@calibration_options
@cluster_options
@method_options
@stereo_options
@config_option
@click.pass_context
def estimate(ctx: click.Context, /, **records: Any) -> None:
    """Estimate the roll angle of each disparity map or stereo pair, one row a frame.

    \b
    To start with:
      rollcli estimate maps/ -o rolls.csv
      rollcli estimate --left left/ --right right/ -o rolls.csv
      rollcli report rolls.csv -o rolls.html

    INPUTS are maps (PNG, TIFF, NPY, PFM), folders of them, quoted patterns, or - for paths on stdin.

    A positive roll means that the rig is rolled counter-clockwise seen from behind: its right end is up.
    """
    options = EstimateOptions(**records)
    resume, overwrite = one_start(ctx, resume=options.result.resume, overwrite=options.running.overwrite)
    options = options._replace(
        result=options.result._replace(resume=resume),
        running=options.running._replace(overwrite=overwrite),
    )

    from rollcli.batch.idle import idle_in_estimate
    from rollcli.batch.run import run_estimate
    from rollcli.frames.idle import repeated_inputs

    tell_idle(ctx, idle_in_estimate(options), repeated_inputs(options.inputs), quiet=options.running.quiet)
    ctx.exit(run_estimate(options, resume_command=resume_command(ctx)))
