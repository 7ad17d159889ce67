"""The options that commands share, each declared once."""

from typing import Any, get_args

import click

from rollcli.cli.command import Declaration, Needs, option, record
from rollcli.cli.types import ANY_NUMBER, DIR, FILE, PATH, POINT, POLYGON, ROI, WIDE_SPAN, Choice, Number
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


def _keeps_numbers(ctx: click.Context) -> bool:
    return ctx.command.name == "derotate"


def _places(ctx: click.Context) -> list[str] | None:
    """List what is named to be read; None where lists or URLs may name any files."""
    from rollcli.files.stores.locations import is_url

    given = ctx.params
    named = [*given["inputs"], *filter(None, (given.get("left"), given.get("right")))]
    return None if given["files_from"] or any(name == "-" or is_url(name) for name in named) else named


def _has_folder(ctx: click.Context) -> bool:
    from rollcli.files.atomic import is_folder

    named = _places(ctx)
    return named is None or any(map(is_folder, named))


def _has_more_than_files(ctx: click.Context) -> bool:
    from rollcli.files.atomic import is_file

    named = _places(ctx)
    return named is None or not all(map(is_file, named))


_PAIRS = Needs(_has_pairs, "the inputs are maps, which are not matched")
_MAPS = Needs(lambda ctx: not _has_pairs(ctx), "pairs are matched, and no stored disparities are read")
_FOLDERS = Needs(_has_more_than_files, "they choose among the files of folders, and none is named")
_HORIZON = Needs(
    lambda ctx: not ctx.params.get("figure") or ctx.params["encoding"] == "depth",
    "a figure shows no horizon",
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
    option(
        "--recursive",
        is_flag=True,
        only_with=[Needs(_has_folder, "no folder is named")],
        help="Search folders recursively.",
    ),
    option(
        "--include",
        multiple=True,
        metavar="GLOB",
        only_with=[_FOLDERS],
        help="Of folders, take only files that match. Repeatable.",
    ),
    option(
        "--exclude",
        multiple=True,
        metavar="GLOB",
        only_with=[_FOLDERS],
        help="Leave out files that match. Repeatable.",
    ),
    option(
        "--every",
        type=Number("N", at_least=1, whole=True),
        help="Take every N-th frame of what is found.",
    ),
)

_named = (
    click.argument("inputs", nargs=-1, type=PATH),
    option("--files-from", type=FILE, help="Read further inputs from FILE, one a line (-: stdin)."),
)

input_options = record(
    "inputs",
    "Input",
    InputOptions,
    *_named,
    option(
        "--sorted",
        is_flag=True,
        help="The names of --files-from are sorted already (frame2 before frame10) and name one map each: "
        "they are read as they are needed, so that a hundred million take no memory.",
    ),
    option(
        "--topic",
        metavar="TOPIC",
        help="The disparity or depth maps of a bag.  [default: the only topic that fits]",
    ),
    *_folders,
)

pair_input_options = record("inputs", "Input", InputOptions, *_named, *_folders)

pair_options = record(
    "pairs",
    "Stereo pairs",
    PairOptions,
    option("--left", type=PATH, help="Left images: a file, folder, quoted pattern, or a video."),
    option("--right", type=PATH, help="Right images, or a video of as many frames."),
    option(
        "--match",
        type=Choice("name", "order"),
        only_with=[_PAIRS],
        help="By name (the same but for left/right, l/r, L1/R1, image_2/image_3, im0/im1 …), or by order.",
    ),
    option(
        "--side-by-side",
        type=Choice(*get_args(Layout)),
        without_word="left-right",
        help="INPUTS are images, or videos (.mp4, .avi, .mkv, .mov), that hold both views; left-right unless "
        "the word is given.",
    ),
)

topic_options = record(
    "topics",
    "Views of a bag",
    TopicOptions,
    option("--left-topic", metavar="TOPIC", help="Left views of the bag that INPUTS name."),
    option("--right-topic", metavar="TOPIC", help="Right views of the bag that INPUTS name."),
    option(
        "--sync-tolerance",
        type=Number("MS", at_least=0),
        help="How far apart the header stamps of a pair may be, milliseconds.",
    ),
)

stereo_options = record(
    "stereo",
    "Stereo matching (OpenCV SGBM)",
    _stereo,
    option(
        "--num-disparities",
        type=Number("PX", above=0, whole=True, auto=True),
        default="auto",
        help="Width of the searched range, pixels, a multiple of 16; auto: found from each pair.",
    ),
    option("--min-disparity", type=Number("PX", whole=True), help="Smallest disparity searched, pixels."),
    option(
        "--block-size",
        type=Number("PX", at_least=1, whole=True),
        help="Side of the matched block, pixels, odd.",
    ),
    option(
        "--sgbm-mode",
        type=Choice(*MODES),
        default=StereoOptions.mode,
        help="OpenCV's variants: 3way (fast), sgbm (5 directions), hh (8: slow, much memory).",
    ),
    option(
        "--uniqueness",
        type=Number("PERCENT", at_least=0, at_most=100, whole=True),
        help="Margin by which the best match must win, percent.",
    ),
    option(
        "--speckle-size",
        type=Number("PX", at_least=0, whole=True),
        help="Drop patches of up to this many pixels; 0: keep all.",
    ),
    option(
        "--speckle-range",
        type=Number("PX", at_least=0, whole=True),
        only_with=[Needs(lambda ctx: ctx.params["speckle_size"] != 0, "--speckle-size 0 keeps every patch")],
        help="Disparity step within a patch, pixels.",
    ),
    option(
        "--downscale",
        type=Number("F", at_least=1),
        help="Match at 1/F of the size; maps and pixel columns then refer to that size.",
    ),
    option(
        "--align",
        type=PATH,
        metavar="auto|off|FILE",
        only_with=[
            Needs(
                lambda ctx: ctx.params["vertical_offset"] == "auto",
                "--vertical-offset says how the right image lies",
            )
        ],
        help="auto: measure how much lower, larger and how far turned the right image is against the left, "
        "correct that before matching, and say so in the row; off: match the images as they are; FILE: "
        "correct all pairs as `rollcli rig --correction FILE` says.",
    ),
    option(
        "--vertical-offset",
        type=Number("PX", auto=True),
        default="auto",
        help="How much lower the right image lies, pixels: corrected as given, and nothing is measured; "
        "auto: as --align says.",
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
        type=Choice("auto", "px", "kitti", "cityscapes", "sgbm", "depth", "foundationstereo"),
        only_with=[
            Needs(  # there a stored 1 is no data
                lambda ctx: (
                    not _keeps_numbers(ctx) or ctx.params["encoding"] in ("cityscapes", "foundationstereo")
                ),
                "rotated maps keep their stored numbers",
            )
        ],
        help="px: pixels as they are; kitti: p/256; cityscapes: (p-1)/256; sgbm: p/16, negative is no data; "
        "depth: metres (whole numbers: millimetres), which a calibration turns into disparities; "
        "foundationstereo: (R*255*255 + G*255 + B)/1000 of an RGB PNG; "
        "auto: float and uint8 are px, uint16 is kitti, int16 is sgbm.",
    ),
    option(
        "--scale",
        type=Number("F", but=0),
        only_with=[
            Needs(
                lambda ctx: not _keeps_numbers(ctx) or ctx.params["scale"] < 0,
                "rotated maps keep their stored numbers",
            )
        ],
        help="Pixels = stored number * F (depth: metres = stored number * F); F replaces the factor of an "
        "encoding, and is negative where maps are stored negative.",
    ),
    option(
        "--invalid",
        type=ANY_NUMBER,
        multiple=True,
        help="A further stored value that means no data (always: nan, inf, <= 0). Repeatable.",
    ),
    only_with=[_MAPS],
)

region_options = record(
    "region",
    "Which pixels",
    RegionOptions,
    option(
        "--mask",
        type=PATH,
        help="Use only non-zero pixels: one mask for all, or a folder with one of the same stem each.",
    ),
    option("--roi", type=ROI, help="Use only this rectangle, pixels; X1 and Y1 are the first left out."),
    option("--polygon", type=POLYGON, help="Use only the inside of these corners, pixels."),
)

method_options = record(
    "method",
    "Method",
    MethodOptions,
    option(
        "--method",
        type=Choice(*METHODS),
        help="; ".join(f"{name}: {method.summary}" for name, method in METHODS.items()) + ".",
    ),
    option(
        "--model",
        type=Choice(*MODELS),
        only_with=[
            Needs(
                lambda ctx: ctx.params["road"] != "all" or ctx.params["method"] not in AREAS,
                "--method {method} fits planes",
            )
        ],
        help="Disparity of the road as a function of the row.",
    ),
    option(
        "--road",
        type=Choice(*ROADS),
        help="auto: find the road first; all: use every valid pixel, as the paper does.",
    ),
    option(
        "--lambda0",
        type=Number("FLOAT", above=0, auto=True),
        only_with=[Needs(lambda ctx: ctx.params["method"] == "gd", "only --method gd has a learning rate")],
        help="First learning rate of gd, rad^2 per unit of energy; auto: 1 / curvature of the energy.",
    ),
    option(
        "--tolerance",
        type=Number("DEG", above=0, at_most=90),
        only_with=[
            Needs(
                lambda ctx: ctx.params["method"] not in AREAS,
                "--method {method} does not iterate on the angle",
            )
        ],
        help="Stop when the angle moves by less than this, degrees.",
    ),
    option(
        "--max-roll",
        type=Number("DEG", above=0, at_most=MAX_ROLL_LIMIT_DEG),
        only_with=[
            Needs(  # areas chooses among its planes by their roll
                lambda ctx: ctx.params["road"] != "all" or ctx.params["method"] == "areas",
                "--road all looks for no road",
            )
        ],
        help="Largest |roll| that road finding considers, degrees.",
    ),
    option(
        "--max-interval",
        type=Number("DEG", above=0, at_most=90),
        help="An angle is suspect when the half-width of its 95 % interval is above this, or when noise and "
        "unevenness alone make 0.45 of this, degrees.",
    ),
    option(
        "--seed",
        type=Number("INT", at_least=0, whole=True),
        only_with=[Needs(lambda ctx: ctx.params["road"] != "all", "--road all draws no samples")],
        help="Seed of road finding's samples.",
    ),
)


def heights_range_option(preview: str) -> Declaration:
    """Declare the colours of a preview, which goes with the option of that name."""
    has_preview = Needs(lambda ctx: ctx.params[preview.replace("-", "_")], f"only --{preview} has colours")
    return option(
        "--heights-range",
        section="Output",
        type=WIDE_SPAN,
        default=HEIGHTS_RANGE,
        show_default=False,
        only_with=[has_preview],
        help="Heights with the outermost colours of a preview, A:B, metres or camera heights.  "
        f"[default: {HEIGHTS_RANGE[0]:.2f}:{HEIGHTS_RANGE[1]:.2f}]",
    )


save_as_option = option(
    "--save-as",
    section="Output",
    type=Choice("png", "tiff", "npy"),
    default="png",
    only_with=[
        Needs(
            lambda ctx: _has_pairs(ctx) or ctx.params["heights"],
            "a map keeps the format of its input",
        ),
        Needs(
            lambda ctx: (
                ctx.command.name == "disparity"
                or any(ctx.params[kind.name] for kind in KINDS if kind.holds != "picture")
            ),
            "only --disparity, --derotated and --heights write maps",
        ),
    ],
    help="Format of maps computed from pairs: 16-bit KITTI PNG (TIFF for a map beyond its 256 px), float32 "
    "TIFF or float32 NPY; of heights: TIFF, or NPY. Maps as PNG and TIFF carry what levelling left "
    "uncertain, for `estimate`; NPY cannot.",
)

output_folder_option = option(
    "-o",
    "--output",
    type=DIR,
    required=True,
    section="Output",
    help="Where the files go, named after their input; folders below the named ones are kept.",
)

image_options = record(
    "images",
    "Images to write, named after their input",
    ImageOptions,
    *(option(f"--{kind.name.replace('_', '-')}", type=DIR, help=kind.help) for kind in KINDS),
    heights_range_option("heights-preview"),
    save_as_option,
)

_running = (
    option(
        "-j",
        "--jobs",
        type=Number("N", at_least=1, whole=True),
        only_with=[Needs(lambda ctx: not ctx.params.get("scheduler"), "--scheduler has workers of its own")],
        help="Worker processes.  [default: the usable processors]",
    ),
    option("--overwrite", is_flag=True, help="Replace results and images that are there."),
    option("--dry-run", is_flag=True, help="List what would be read and written, and do nothing."),
    option("-q", "--quiet", is_flag=True, help="Say nothing but errors on stderr."),
    option("-v", "--verbose", is_flag=True, help="Say more on stderr."),
)

running_options = record("running", "Running", RunningOptions, *_running)

cluster_options = record(
    "running",
    "Running",
    RunningOptions,
    *_running,
    option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on this Dask cluster: its scheduler's address, such as tcp://host:8786, or scheduler file.",
    ),
)


calibration_options = record(
    "calibration",
    "Calibration of the rectified pair, for pitch, height, horizon and depth maps",
    CalibrationOptions,
    option(
        "--calib",
        type=PATH,
        multiple=True,
        metavar="PATH",
        help="A file, or a folder with one of the same stem each: KITTI, Middlebury, ETH3D, OpenCV, ROS "
        "(twice: left, right), Cityscapes, ORB-SLAM, DrivingStereo; recognised by content.",
    ),
    option("--focal", type=Number("PX", above=0), help="Focal length, pixels.  [default: the file's]"),
    option(
        "--principal-point",
        type=POINT,
        help="Optical axis in the left view, from the centre of the top-left pixel.  [default: the file's]",
    ),
    option(
        "--baseline",
        type=Number("M", above=0),
        only_with=[_BASELINE],
        help="Distance between the cameras, metres; gives the height.  [default: the file's]",
    ),
    option(
        "--doffs",
        type=Number("PX"),
        help="CX of the right view less that of the left one, pixels.  [default: the file's, else 0]",
    ),
    only_with=[_HORIZON],
)
