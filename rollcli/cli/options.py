"""The options that commands share, each declared once."""

from typing import Any, get_args

import click

from rollcli.cli.command import Needs, option, record
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
from rollcli.run.options import (
    HEIGHTS_RANGE,
    KINDS,
    EncodingOptions,
    ImageOptions,
    InputOptions,
    Layout,
    MethodOptions,
    PairOptions,
    RegionOptions,
    RunningOptions,
    TopicOptions,
)
from rollcli.stereo.options import MODES, StereoOptions


def _has_pairs(ctx: click.Context) -> bool:
    """Tell whether the frames are pairs."""
    named = ("left", "right", "side_by_side", "left_topic", "right_topic")
    return ctx.command.name == "disparity" or any(ctx.params.get(name) for name in named)


_PAIRS = Needs(_has_pairs, "the inputs are maps, which are not matched")
_MAPS = Needs(lambda ctx: not _has_pairs(ctx), "pairs are matched, and no stored disparities are read")
_HORIZON = Needs(
    lambda ctx: not ctx.params.get("figure") or ctx.params["encoding"] == "depth", "a figure shows no horizon"
)
_BASELINE = Needs(
    lambda ctx: ctx.command.name != "vdisparity" or ctx.params["encoding"] == "depth",
    "the horizon does not depend on it; only --encoding depth needs it",
)


def _stereo(
    *, num_disparities: int | str, sgbm_mode: str, vertical_offset: float | str, **values: Any
) -> StereoOptions:
    searched = None if num_disparities == "auto" else int(num_disparities)
    offset = None if vertical_offset == "auto" else float(vertical_offset)
    return StereoOptions(num_disparities=searched, mode=sgbm_mode, vertical_offset=offset, **values)


_folders = (
    option("--recursive", FLAG, "Search folders recursively."),
    option("--include", Text("GLOB"), "Take only files that match. Repeatable.", multiple=True),
    option("--exclude", Text("GLOB"), "Leave out files that match. Repeatable.", multiple=True),
    option("--every", Number("N", at_least=1, whole=True), "Take every N-th frame of what is found."),
)

_named = (
    click.argument("inputs", nargs=-1, type=PATH),
    option("--files-from", FILE, "Read further inputs from FILE, one a line (-: stdin)."),
)

input_options = record(
    "inputs",
    "Input",
    InputOptions,
    *_named,
    option(
        "--sorted",
        FLAG,
        "The names of --files-from are sorted already (frame2 before frame10) and name one map each: "
        "they are read as they are needed, so that a hundred million take no memory.",
    ),
    option(
        "--topic", Text("TOPIC"), "The disparity or depth maps of a bag.  [default: the only topic that fits]"
    ),
    *_folders,
)

pair_input_options = record("inputs", "Input", InputOptions, *_named, *_folders)

pair_options = record(
    "pairs",
    "Stereo pairs",
    PairOptions,
    option("--left", PATH, "Left images: a file, folder, quoted pattern, or a video."),
    option("--right", PATH, "Right images, or a video of as many frames."),
    option(
        "--match",
        Choice("name", "order"),
        "By name (the same but for left/right, l/r, L1/R1, image_2/image_3, im0/im1 …), or by order.",
        _PAIRS,
    ),
    option(
        "--side-by-side",
        Choice(*get_args(Layout)),
        "INPUTS are images, or videos (.mp4, .avi, .mkv, .mov), that hold both views; left-right unless "
        "the word is given.",
        without_word="left-right",
    ),
)

topic_options = record(
    "topics",
    "Views of a bag",
    TopicOptions,
    option("--left-topic", Text("TOPIC"), "Left views of the bag that INPUTS name."),
    option("--right-topic", Text("TOPIC"), "Right views of the bag that INPUTS name."),
    option(
        "--sync-tolerance",
        Number("MS", at_least=0),
        "How far apart the header stamps of a pair may be, milliseconds.",
    ),
)

stereo_options = record(
    "stereo",
    "Stereo matching (OpenCV SGBM)",
    _stereo,
    option(
        "--num-disparities",
        Number("PX", above=0, whole=True, auto=True),
        "Width of the searched range, pixels, a multiple of 16; auto: found from each pair.",
        default="auto",
    ),
    option("--min-disparity", Number("PX", whole=True), "Smallest disparity searched, pixels."),
    option("--block-size", Number("PX", at_least=1, whole=True), "Side of the matched block, pixels, odd."),
    option(
        "--sgbm-mode",
        Choice(*MODES),
        "OpenCV's variants: 3way (fast), sgbm (5 directions), hh (8: slow, much memory).",
        default=StereoOptions.mode,
    ),
    option(
        "--uniqueness",
        Number("PERCENT", at_least=0, at_most=99, whole=True),
        "Margin by which the best match must win, percent.",
    ),
    option(
        "--speckle-size",
        Number("PX", at_least=0, whole=True),
        "Drop patches of up to this many pixels; 0: keep all.",
    ),
    option("--speckle-range", Number("PX", at_least=0, whole=True), "Disparity step within a patch, pixels."),
    option(
        "--downscale",
        Number("F", at_least=1),
        "Match at 1/F of the size; maps and pixel columns then refer to that size.",
    ),
    option(
        "--align",
        FilePath("auto|off|FILE"),
        "auto: measure how much lower, larger and how far turned the right image is against the left, "
        "correct that before matching, and say so in the row; off: match the images as they are; FILE: "
        "correct all pairs as `rollcli rig --correction FILE` says, each by its own offset as far as the "
        "drive leaves it open.",
        Needs(
            lambda ctx: ctx.params["vertical_offset"] == "auto",
            "--vertical-offset says how the right image lies",
        ),
    ),
    option(
        "--vertical-offset",
        Number("PX", auto=True),
        "How much lower the right image lies, pixels: corrected as given, and nothing is measured; "
        "auto: as --align says.",
        default="auto",
    ),
    only_with=[_PAIRS],
    fields=StereoOptions,
)

encoding_options = record(
    "encoding",
    "What the stored numbers mean",
    EncodingOptions,
    option(
        "--encoding",
        Choice("auto", "px", "kitti", "cityscapes", "sgbm", "depth", "foundationstereo"),
        "px: pixels as they are; kitti: p/256; cityscapes: (p-1)/256; sgbm: p/16, negative is no data; "
        "depth: metres (whole numbers: millimetres), which a calibration turns into disparities; "
        "foundationstereo: (R*255*255 + G*255 + B)/1000 of an RGB PNG; "
        "auto: float and uint8 are px, uint16 is kitti, int16 is sgbm.",
    ),
    option(
        "--scale",
        Number("F", but=0),
        "Pixels = stored number * F (depth: metres = stored number * F); F replaces the factor of an "
        "encoding, and is negative where maps are stored negative.",
    ),
    option(
        "--invalid",
        ANY_NUMBER,
        "A further stored value that means no data (always: nan, inf, <= 0). Repeatable.",
        multiple=True,
    ),
    only_with=[_MAPS],
)

region_options = record(
    "region",
    "Which pixels",
    RegionOptions,
    option(
        "--mask",
        PATH,
        "Use only non-zero pixels: one mask for all, or a folder with one of the same stem each.",
    ),
    option("--roi", ROI, "Use only this rectangle, pixels; X1 and Y1 are the first left out."),
    option("--polygon", POLYGON, "Use only the inside of these corners, pixels."),
)

method_options = record(
    "method",
    "Method",
    MethodOptions,
    option(
        "--method",
        Choice(*METHODS),
        "; ".join(f"{name}: {method.summary}" for name, method in METHODS.items()) + ".",
    ),
    option(
        "--model",
        Choice(*MODELS),
        "Disparity of the road as a function of the row.",
        Needs(
            lambda ctx: ctx.params["road"] != "all" or ctx.params["method"] not in AREAS,
            "--method {method} fits planes",
        ),
    ),
    option(
        "--road", Choice(*ROADS), "auto: find the road first; all: use every valid pixel, as the paper does."
    ),
    option(
        "--lambda0",
        Number("FLOAT", above=0, auto=True),
        "First learning rate of gd, rad^2 per unit of energy; auto: 1 / curvature of the energy.",
        Needs(lambda ctx: ctx.params["method"] == "gd", "only --method gd has a learning rate"),
    ),
    option(
        "--tolerance",
        Number("DEG", above=0, at_most=90),
        "Stop when the angle moves by less than this, degrees.",
        Needs(
            lambda ctx: ctx.params["method"] not in AREAS, "--method {method} does not iterate on the angle"
        ),
    ),
    option(
        "--max-roll",
        Number("DEG", above=0, at_most=MAX_ROLL_LIMIT_DEG),
        "Largest |roll| that road finding considers, degrees.",
        Needs(  # areas chooses among its planes by their roll
            lambda ctx: ctx.params["road"] != "all" or ctx.params["method"] == "areas",
            "--road all looks for no road",
        ),
    ),
    option(
        "--max-interval",
        Number("DEG", above=0, at_most=90),
        "An angle is suspect when the half-width of its 95 % interval is above this, or when noise and "
        "unevenness alone make 0.45 of this, degrees.",
    ),
    option("--seed", Number("INT", at_least=0, whole=True), "Seed of road finding's samples."),
)


heights_range_option = option(
    "--heights-range",
    WIDE_SPAN,
    "Heights with the outermost colours of a preview, A:B, metres or camera heights.",
    section="Output",
    default="{:.2f}:{:.2f}".format(*HEIGHTS_RANGE),
)


save_as_option = option(
    "--save-as",
    Choice("png", "tiff", "npy"),
    "Format of maps computed from pairs: 16-bit KITTI PNG (TIFF for a map beyond its 256 px), float32 "
    "TIFF or float32 NPY; of heights: TIFF, or NPY. Maps as PNG and TIFF carry what levelling left "
    "uncertain, for `estimate`; NPY cannot.",
    Needs(lambda ctx: _has_pairs(ctx) or ctx.params["heights"], "a map keeps the format of its input"),
    Needs(
        lambda ctx: (
            ctx.command.name == "disparity"
            or any(ctx.params[kind.name] for kind in KINDS if kind.holds != "picture")
        ),
        "only --disparity, --derotated and --heights write maps",
    ),
    section="Output",
    default="png",
)

output_folder_option = option(
    "-o, --output",
    DIR,
    "Where the files go, named after their input; folders below the named ones are kept.",
    required=True,
    section="Output",
)

image_options = record(
    "images",
    "Images to write, named after their input",
    ImageOptions,
    *(option(f"--{kind.name.replace('_', '-')}", DIR, kind.help) for kind in KINDS),
    heights_range_option,
    save_as_option,
)

_running = (
    option(
        "-j, --jobs",
        Number("N", at_least=1, whole=True),
        "Worker processes.  [default: the usable processors]",
    ),
    option("--overwrite", FLAG, "Replace results and images that are there."),
    option("--dry-run", FLAG, "List what would be read and written, and do nothing."),
    option("-q, --quiet", FLAG, "Say nothing but errors on stderr."),
    option("-v, --verbose", FLAG, "Say more on stderr."),
)

running_options = record("running", "Running", RunningOptions, *_running)

cluster_options = record(
    "running",
    "Running",
    RunningOptions,
    *_running,
    option(
        "--scheduler",
        Text("ADDRESS"),
        "Run on this Dask cluster: its scheduler's address, such as tcp://host:8786, or scheduler file.",
    ),
)


calibration_options = record(
    "calibration",
    "Calibration of the rectified pair, for pitch, height, horizon and depth maps",
    CalibrationOptions,
    option(
        "--calib",
        PATH,
        "A file, or a folder with one of the same stem each: KITTI, Middlebury, ETH3D, OpenCV, ROS "
        "(twice: left, right), Cityscapes, ORB-SLAM, DrivingStereo; recognised by content.",
        multiple=True,
        metavar="PATH",
    ),
    option("--focal", Number("PX", above=0), "Focal length, pixels.  [default: the file's]"),
    option(
        "--principal-point",
        POINT,
        "Optical axis in the left view, from the centre of the top-left pixel.  [default: the file's]",
    ),
    option(
        "--baseline",
        Number("M", above=0),
        "Distance between the cameras, metres; gives the height.  [default: the file's]",
        _BASELINE,
    ),
    option(
        "--doffs",
        Number("PX"),
        "CX of the right view less that of the left one, pixels.  [default: the file's, else 0]",
    ),
    only_with=[_HORIZON],
)
