"""The options that commands share, each declared once."""

from typing import get_args

import click

from rollcli.cli.command import Needs, Section, option
from rollcli.cli.types import (
    ANY_NUMBER,
    DIR,
    FILE,
    FLAG,
    PATH,
    POINT,
    POLYGON,
    ROI,
    WIDE_SPAN,
    Choice,
    FilePath,
    Number,
    Text,
)
from rollcli.estimator.request import AREAS, MAX_ROLL_LIMIT_DEG, METHODS, MODELS, ROADS
from rollcli.rig.calibration import CalibrationOptions
from rollcli.run import options as records
from rollcli.stereo.options import MODES, StereoOptions


def _has_pairs(ctx: click.Context) -> bool:
    """Tell whether the frames are pairs."""
    named = ("left", "right", "side_by_side", "left_topic", "right_topic")
    return ctx.command.name == "disparity" or any(ctx.params.get(name) for name in named)


# what options need to have an effect
_PAIRS = Needs(_has_pairs, "the inputs are maps, which are not matched")
_MAPS = Needs(lambda ctx: not _has_pairs(ctx), "pairs are matched, and no stored disparities are read")
_HORIZON = Needs(
    lambda ctx: not ctx.params.get("figure") or ctx.params["encoding"] == "depth", "a figure shows no horizon"
)
_BASELINE = Needs(
    lambda ctx: ctx.command.name not in ("vdisparity", "disparity") or ctx.params.get("encoding") == "depth",
    "horizon and levelling do not depend on it; only depth maps need it",
)
_OFFSET = Needs(
    lambda ctx: ctx.params.get("encoding") != "depth" or _has_pairs(ctx), "depths do not depend on it"
)
_STAMPS = Needs(lambda ctx: ctx.params["left_topic"], "only views of a bag are paired by their stamps")
_MEASURED = Needs(
    lambda ctx: ctx.params["vertical_offset"] is None, "--vertical-offset says how the right image lies"
)
_PARABOLA = Needs(
    lambda ctx: ctx.params["road"] != "all" or ctx.params["method"] not in AREAS,
    "--method {method} fits planes",
)
_LEARNS = Needs(lambda ctx: ctx.params["method"] == "gd", "only --method gd has a learning rate")
_ITERATES = Needs(
    lambda ctx: ctx.params["method"] not in (*AREAS, "exact"),
    "--method {method} does not iterate on the angle",
)
_FINDS = Needs(lambda ctx: ctx.params["road"] != "all", "--road all looks for no road")
_SEARCHES = Needs(  # areas chooses among its planes by their roll
    lambda ctx: _FINDS.holds(ctx) or ctx.params["method"] == "areas", _FINDS.reason
)
_PREVIEW = Needs(
    lambda ctx: any(ctx.params.get(each) for each in ("preview", "heights_preview")),
    "only previews of heights have colours",
)
_OWN_FORMAT = Needs(
    lambda ctx: _has_pairs(ctx) or ctx.params["heights"], "a map keeps the format of its input"
)
_WRITES_MAPS = Needs(
    lambda ctx: (
        ctx.command.name == "disparity"
        or any(ctx.params[kind.name] for kind in records.KINDS if kind.holds != "picture")
    ),
    "only --disparity, --derotated and --heights write maps",
)
_HERE = Needs(lambda ctx: not ctx.params.get("scheduler"), "the workers of --scheduler do the work")


_folders = (
    option("--recursive", FLAG),
    option("--include", Text("GLOB"), multiple=True),
    option("--exclude", Text("GLOB"), multiple=True),
    option("--every", Number("N", at_least=1, whole=True)),
)

_named = (click.argument("inputs", nargs=-1, type=PATH), option("--files-from", FILE))

input_options = Section("inputs", "Input", records.InputOptions).of(
    *_named,
    option("--sorted", FLAG),
    option("--topic", Text("TOPIC"), _MAPS),
    *_folders,
)

pair_input_options = Section("inputs", "Input", records.InputOptions).of(*_named, *_folders)

pair_options = Section("pairs", "Stereo pairs", records.PairOptions).of(
    option("--left", PATH),
    option("--right", PATH),
    option("--match", Choice("name", "order"), _PAIRS),
    option("--side-by-side", Choice(*get_args(records.Layout)), without_word="left-right"),
)

topic_options = Section("topics", "Views of a bag", records.TopicOptions).of(
    option("--left-topic", Text("TOPIC")),
    option("--right-topic", Text("TOPIC")),
    option("--sync-tolerance", Number("MS", at_least=0), _STAMPS),
)

stereo_options = Section("stereo", "Stereo matching (OpenCV SGBM)", StereoOptions, [_PAIRS]).of(
    option("--num-disparities", Number("PX", above=0, whole=True, auto=None), default="auto"),
    option("--min-disparity", Number("PX", whole=True)),
    option("--block-size", Number("PX", at_least=1, whole=True)),
    option("--sgbm-mode", Choice(*MODES)),
    option("--uniqueness", Number("PERCENT", at_least=0, at_most=99, whole=True)),
    option("--speckle-size", Number("PX", at_least=0, whole=True)),
    option("--speckle-range", Number("PX", at_least=0, whole=True)),
    option("--downscale", Number("F", at_least=1)),
    option("--align", FilePath("auto|off|FILE"), _MEASURED),
    option("--vertical-offset", Number("PX", auto=None), default="auto"),
)

encoding_options = Section("encoding", "What the stored numbers mean", records.EncodingOptions, [_MAPS]).of(
    option("--encoding", Choice("auto", "px", "kitti", "cityscapes", "sgbm", "depth", "foundationstereo")),
    option("--scale", Number("F", but=0)),
    option("--invalid", ANY_NUMBER, multiple=True),
)

region_options = Section("region", "Which pixels", records.RegionOptions).of(
    option("--mask", PATH),
    option("--roi", ROI),
    option("--polygon", POLYGON),
)

method_options = Section("method", "Method", records.MethodOptions).of(
    option(
        "--method",
        Choice(*METHODS),
        text="; ".join(f"{name}: {method.summary}" for name, method in METHODS.items()) + ".",
    ),
    option("--model", Choice(*MODELS), _PARABOLA),
    option("--road", Choice(*ROADS)),
    option("--lambda0", Number("FLOAT", above=0, auto="auto"), _LEARNS),
    option("--tolerance", Number("DEG", above=0, at_most=90), _ITERATES),
    option("--max-roll", Number("DEG", above=0, at_most=MAX_ROLL_LIMIT_DEG), _SEARCHES),
    option("--max-interval", Number("DEG", above=0, at_most=90)),
    option("--seed", Number("INT", at_least=0, whole=True), _FINDS),
)


heights_range_option = option("--heights-range", WIDE_SPAN, _PREVIEW, section="Output")

save_as_option = option(
    "--save-as", Choice("png", "tiff", "npy"), _OWN_FORMAT, _WRITES_MAPS, section="Output"
)

output_folder_option = option("-o, --output", DIR, required=True, section="Output")

image_options = Section("images", "Images to write, named after their input", records.ImageOptions).of(
    *(option(f"--{kind.name.replace('_', '-')}", DIR) for kind in records.KINDS),
    heights_range_option,
    save_as_option,
)

_running = (
    option("-j, --jobs", Number("N", at_least=1, whole=True), _HERE),
    option("--overwrite", FLAG),
    option("--dry-run", FLAG),
    option("-q, --quiet", FLAG),
    option("-v, --verbose", FLAG),
)

running_options = Section("running", "Running", records.RunningOptions).of(*_running)

cluster_options = Section("running", "Running", records.RunningOptions).of(
    *_running, option("--scheduler", Text("ADDRESS"))
)


calibration_options = Section(
    "calibration",
    "Calibration of the rectified pair, for pitch, height, horizon, levelling and depth maps",
    CalibrationOptions,
    [_HORIZON],
).of(
    option("--calib", PATH, multiple=True, metavar="PATH"),
    option("--focal", Number("PX", above=0)),
    option("--principal-point", POINT),
    option("--baseline", Number("M", above=0), _BASELINE),
    option("--doffs", Number("PX"), _OFFSET),
)
