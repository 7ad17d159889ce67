"""The options of `estimate`, the conversions and `rig`. Import-light: the command line loads it for its help.

What a docstring says of a field is the help of the field's option, and names values as the option takes them.
"""

import math
import posixpath
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

from rollcli.estimator.request import (
    LAMBDA0,
    MAX_INTERVAL_DEG,
    MAX_ROLL_DEG,
    TOLERANCE_DEG,
    LearningRate,
    Request,
)
from rollcli.messages import say
from rollcli.rig.calibration import Calibration, CalibrationOptions, request_with
from rollcli.stereo.options import StereoOptions

Save = Literal["png", "tiff", "npy"]
ENDING_OF_FORMAT: dict[Save, str] = {"png": ".png", "tiff": ".tif", "npy": ".npy"}


class ImageKind(NamedTuple):
    """A kind of image.

    Attributes
    ----------
    name : str
        Its field of `ImageOptions`, its option with "-" for "_", and the usual name of its folder.
    holds : str
        "picture": an 8-bit PNG to look at; "map": disparities as `--save-as` says; "as input": the same, but
        in the input's own type and format where that is a map; "numbers": float32, TIFF or NPY.
    """

    name: str
    holds: Literal["picture", "map", "as input", "numbers"]


class Written(NamedTuple):
    """A file that is written for each frame, named after it.

    Attributes
    ----------
    kind : str
        What it holds; `ImageKind` names those of `estimate`.
    folder : str
    endings : tuple of (str or None)
        Those that it may have, the usual one first; None: the frame's own.
    """

    kind: str
    folder: str
    endings: tuple[str | None, ...]


KINDS = (
    ImageKind("derotated", "as input"),
    ImageKind("vdisparity", "picture"),
    ImageKind("disparity", "map"),
    ImageKind("road_mask", "picture"),
    ImageKind("heights", "numbers"),
    ImageKind("heights_preview", "picture"),
)

Layout = Literal["left-right", "top-bottom"]
HEIGHTS_RANGE = (-0.10, 0.10)


class InputOptions(NamedTuple):
    """Which maps to read.

    Attributes
    ----------
    inputs : tuple of str
        Files, folders and patterns; "-" for paths on stdin.
    files_from : str or None
        Read further inputs from FILE, one a line (-: stdin).
    recursive : bool
        Search folders recursively.
    include : tuple of str
        Take only files that match. Repeatable.
    exclude : tuple of str
        Leave out files that match. Repeatable.
    sorted : bool
        The names of --files-from are sorted already (frame2 before frame10) and name one map each: they
        are read as they are needed, so that a hundred million take no memory.
    topic : str or None
        The disparity or depth maps of a bag. [default: the only topic that fits]
    every : int
        Take every N-th frame of what is found.
    """

    inputs: tuple[str, ...] = ()
    files_from: str | None = None
    recursive: bool = False
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    sorted: bool = False
    topic: str | None = None
    every: int = 1


class PairOptions(NamedTuple):
    """Which stereo pairs to read, instead of maps.

    Attributes
    ----------
    left : str or None
        Left images: a file, folder, quoted pattern, or a video.
    right : str or None
        Right images, or a video of as many frames.
    match : {"name", "order"}
        By name (the same but for left/right, l/r, L1/R1, image_2/image_3, im0/im1 …), or by order.
    side_by_side : str or None
        INPUTS are images, or videos (.mp4, .m4v, .mov, .avi, .mkv, .webm), that hold both views; left-right
        unless the word is given.
    """

    left: str | None = None
    right: str | None = None
    match: Literal["name", "order"] = "name"
    side_by_side: Layout | None = None


class TopicOptions(NamedTuple):
    """Which views of a bag make pairs.

    Attributes
    ----------
    left_topic : str or None
        Left views of the bag that INPUTS name.
    right_topic : str or None
        Right views of the bag that INPUTS name.
    sync_tolerance : float
        How far apart the header stamps of a pair may be, milliseconds.
    """

    left_topic: str | None = None
    right_topic: str | None = None
    sync_tolerance: float = 1.0


class EncodingOptions(NamedTuple):
    """How stored numbers become pixels of disparity.

    Attributes
    ----------
    encoding : str
        px: pixels as they are; kitti: p/256; cityscapes: (p-1)/256; sgbm: p/16; depth: metres (whole
        numbers: millimetres), which a calibration turns into disparities; foundationstereo: (R*255*255 +
        G*255 + B)/1000 of an RGB PNG; auto: uint16 is kitti, int16 is sgbm, the rest is px.
    scale : float or None
        Pixels = stored number * F (depth: metres = stored number * F); F replaces the factor of an
        encoding, and is negative where maps are stored negative.
    invalid : tuple of float
        A further stored value that means no data (always: nan, inf, <= 0, the largest number of 16
        bits). Repeatable.
    """

    encoding: str = "auto"
    scale: float | None = None
    invalid: tuple[float, ...] = ()


class RegionOptions(NamedTuple):
    """Which pixels may be used.

    Attributes
    ----------
    mask : str or None
        Use only non-zero pixels: one mask for all, or a folder with one of the same stem each.
    roi : tuple of int or None
        Use only this rectangle, pixels of the map; X1 and Y1 are the first left out.
    polygon : tuple of (float, float), or None
        Use only the inside of these corners, pixels of the map.
    """

    mask: str | None = None
    roi: tuple[int, int, int, int] | None = None
    polygon: tuple[tuple[float, float], ...] | None = None


class MethodOptions(NamedTuple):
    """How the angle is found; `rollcli.estimator.request` has the names.

    Attributes
    ----------
    method : str
        One of `METHODS`.
    model : str
        Disparity of the road as a function of the row.
    road : str
        auto: find the road first; all: use every valid pixel, as the paper does.
    lambda0 : float or "auto"
        First learning rate of gd, rad^2 per unit of energy; auto: 1 / curvature of the energy.
    tolerance_deg : float
        Stop when the angle moves by less than this, degrees.
    max_roll_deg : float
        Largest |roll| that road finding considers, degrees.
    max_interval_deg : float
        An angle is suspect when the half-width of its 95 % interval is above this, or when noise and
        misfit alone make 0.45 of this, degrees.
    seed : int
        Seed of road finding's samples.
    """

    method: str = "gd"
    model: str = "parabola"
    road: str = "auto"
    lambda0: LearningRate = LAMBDA0
    tolerance_deg: float = TOLERANCE_DEG
    max_roll_deg: float = MAX_ROLL_DEG
    max_interval_deg: float = MAX_INTERVAL_DEG
    seed: int = 0

    def request(self, slope_error: float = 0.0, calibration: Calibration | None = None) -> Request:
        """Return what is asked of the estimator, in radians, for a map with this error and calibration."""
        given: dict[str, Any] = {
            name.removesuffix("_deg"): math.radians(value) if name.endswith("_deg") else value
            for name, value in self._asdict().items()
        }
        return request_with(calibration, Request(**given, slope_error=slope_error))


class ImageOptions(NamedTuple):
    """Which images to write, each of `KINDS` into a folder of its own.

    Attributes
    ----------
    derotated : str or None
        The map rotated upright; type and format of the input.
    vdisparity : str or None
        v-disparity of the map rotated upright, with the road, PNG; vdisparity draws maps as they are.
    disparity : str or None
        The disparity map that was computed from a pair.
    road_mask : str or None
        The found road, drawn on the left image of a pair or the map, PNG.
    heights : str or None
        Heights over the road, float32 TIFF (--save-as npy: NPY): metres with a calibration that has a
        baseline, else camera heights; NaN where there is no disparity.
    heights_preview : str or None
        Heights over the road to look at, over the left image of a pair, PNG; every frame in the same
        colours.
    heights_range : tuple of float
        Heights with the outermost colours of a preview, A:B, metres or camera heights.
    save_as : {"png", "tiff", "npy"}
        Format of maps computed from pairs: 16-bit KITTI PNG (TIFF for a map beyond its 256 px), float32
        TIFF or float32 NPY; of heights: TIFF, or NPY. Maps as PNG and TIFF carry what levelling left
        uncertain, for `estimate`; NPY cannot.
    """

    derotated: str | None = None
    vdisparity: str | None = None
    disparity: str | None = None
    road_mask: str | None = None
    heights: str | None = None
    heights_preview: str | None = None
    heights_range: tuple[float, float] = HEIGHTS_RANGE
    save_as: Save = "png"

    def writes(self, *, computed: bool) -> tuple[Written, ...]:
        """List the images that were requested; `computed`: of maps that are computed from pairs.

        A TIFF takes the place of a KITTI PNG that cannot hold the map.
        """
        png, tiff, asked = (ENDING_OF_FORMAT[each] for each in ("png", "tiff", self.save_as))
        maps = (png, tiff) if asked == png else (asked,)
        endings: dict[str, tuple[str | None, ...]] = {
            "picture": (png,),
            "map": maps,
            "as input": maps if computed else (None,),
            "numbers": maps[-1:],
        }
        named = ((kind, getattr(self, kind.name)) for kind in KINDS)
        return tuple(
            Written(kind.name, folder, endings[kind.holds]) for kind, folder in named if folder is not None
        )


class RunningOptions(NamedTuple):
    """How the program runs and how much it says.

    Attributes
    ----------
    jobs : int or None
        Worker processes. [default: the usable processors]
    scheduler : str or None
        Run on this Dask cluster: its scheduler's address, such as tcp://host:8786, or scheduler file.
    overwrite : bool
        Replace results and images that are there.
    dry_run : bool
        List what would be read and written, and do nothing.
    quiet : bool
        Say nothing but errors on stderr.
    verbose : bool
        Say more on stderr.
    """

    jobs: int | None = None
    scheduler: str | None = None
    overwrite: bool = False
    dry_run: bool = False
    quiet: bool = False
    verbose: bool = False

    def note(self, *messages: str) -> None:
        """Write a line for each message to standard error, each once, unless quiet."""
        if not self.quiet:
            say(*dict.fromkeys(messages))


Form = Literal["csv", "jsonl", "parquet"]
_FORM_OF_ENDING: dict[str, Form] = {".jsonl": "jsonl", ".ndjson": "jsonl", ".parquet": "parquet"}


class ResultOptions(NamedTuple):
    """Where the rows go, and which frames they are of.

    `shard` is (I, N), I from 1: every N-th frame, or one of N runs of consecutive ones, as `shard_by` says.
    An `update` is a `resume` as well.

    Attributes
    ----------
    output : str
        Where the rows go (-: stdout).
    format : str or None
        CSV, JSON Lines, or Parquet (a folder of parts). [default: by FILE's ending, else csv]
    resume : bool
        Keep the rows of an interrupted run and do the rest.
    update : bool
        As --resume, also of a whole result: do the frames again whose content has changed, add new ones,
        and leave out those that are gone.
    retry_failed : bool
        With --resume or --update: do the frames again whose rows are error, such as those of files mended
        since.
    shard : tuple of int
        Take every N-th frame from the I-th.
    shard_by : {"every", "range"}
        every: --shard takes every N-th frame; range: the I-th of N runs of consecutive frames.
    fail_fast : bool
        Stop at the first frame that fails.
    timing : bool
        Add the column elapsed_ms: milliseconds spent on the frame.
    part_rows : int
        Rows of each part, of Parquet and of results in an object store.
    """

    output: str = "-"
    format: Form | None = None
    resume: bool = False
    update: bool = False
    retry_failed: bool = False
    shard: tuple[int, int] = (1, 1)
    shard_by: Literal["every", "range"] = "every"
    fail_fast: bool = False
    timing: bool = False
    part_rows: int = 1000

    @property
    def form(self) -> Form:
        """The format of the rows: the one given, else by the ending of the output."""
        ending = posixpath.splitext(self.output.lower().rstrip("/"))[1]
        return self.format or _FORM_OF_ENDING.get(ending, "csv")

    @property
    def in_parts(self) -> bool:
        """Whether the result is a folder of parts."""
        from rollcli.files.stores.locations import is_url

        return self.form == "parquet" or is_url(self.output)


Told = TypeVar("Told", bound="FramesOptions")


@dataclass(frozen=True, kw_only=True)
class FramesOptions:
    """What every command is told that goes through frames, and what it tells its workers of them: see `told`.

    `root` is the folder where relative paths start, for workers on other machines; empty for this one.
    `replaces` tells whether files that are in the place of an image are replaced. `retry_of` names the result
    whose failed frames are done again; empty otherwise. `run` names the run: what no worker sees changing, an
    object, is read anew by each. `notes` tells whether workers say what each frame was read from.
    """

    calibrates: ClassVar[bool] = True  # whether it has use of a calibration

    inputs: InputOptions = field(default_factory=InputOptions)
    running: RunningOptions = field(default_factory=RunningOptions)
    pairs: PairOptions = field(default_factory=PairOptions)
    topics: TopicOptions = field(default_factory=TopicOptions)
    encoding: EncodingOptions = field(default_factory=EncodingOptions)
    stereo: StereoOptions = field(default_factory=StereoOptions)
    region: RegionOptions = field(default_factory=RegionOptions)
    calibration: CalibrationOptions = field(default_factory=CalibrationOptions)
    method: MethodOptions = field(default_factory=MethodOptions)
    images: ImageOptions = field(default_factory=ImageOptions)
    root: str = ""
    replaces: bool = False
    retry_of: str = ""
    run: str = ""
    notes: bool = False

    @property
    def paired(self) -> bool:
        """Whether the frames are stereo pairs."""
        return any((*self.pairs[:2], self.pairs.side_by_side, *self.topics[:2]))

    @property
    def files(self) -> tuple[Written, ...]:
        """The files that may be written for a frame, as the user names their folders."""
        return self.images.writes(computed=self.paired)

    @property
    def writes(self) -> tuple[Written, ...]:
        """The same, as a worker locates their folders."""
        return tuple(each._replace(folder=self.at(each.folder)) for each in self.files)

    @property
    def folders(self) -> list[str]:
        """Where files are written: no inputs are searched there."""
        return list(dict.fromkeys(each.folder for each in self.files))

    @property
    def told(self: "Told") -> "Told":
        """What workers are told; of many inputs each gets its own alone."""
        stereo = replace(self.stereo, align=self.stereo.correction or self.stereo.align)
        root = "" if self.running.scheduler is None else str(Path.cwd())
        replaces = self.running.overwrite
        return replace(self, inputs=InputOptions(), stereo=stereo, root=root, replaces=replaces)

    def at(self, path: str) -> str:
        """Locate a path on this worker."""
        from rollcli.files.stores.locations import located

        return located(self.root, path)


@dataclass(frozen=True, kw_only=True)
class EstimateOptions(FramesOptions):
    """Every option of `rollcli estimate`."""

    result: ResultOptions = field(default_factory=ResultOptions)


@dataclass(frozen=True, kw_only=True)
class ConvertOptions(FramesOptions):
    """What every command is told that makes files of each frame.

    Attributes
    ----------
    output : str
        Where the files go, named after their input; folders below the named ones are kept.
    result : str or None
        Has the row of each map.
    skip_suspect : bool
        Leave out the maps whose row is suspect.
    """

    output: str
    result: str | None = None
    skip_suspect: bool = False


def _picture(preview: str | None) -> list[Written]:
    """List the picture to look at, if it is asked for."""
    return [] if preview is None else [Written("preview", preview, (".png",))]


@dataclass(frozen=True, kw_only=True)
class DerotateOptions(ConvertOptions):
    """Every option of `rollcli derotate`: one angle for all maps, or a result with one of each.

    Attributes
    ----------
    roll_deg : float or None
        Of the rig, for every map, degrees; positive: its right end is up.
    expand : bool
        Enlarge the maps so that their corners are kept.
    save_matrix : bool
        Beside each map write NAME.txt: the 3x3 matrix that takes its pixels to the new ones.
    result : str or None
        The angle of each map, from what `rollcli estimate` wrote; matched by stem.
    skip_suspect : bool
        With --from, leave out the maps whose angle is suspect.
    """

    calibrates = False

    roll_deg: float | None = None
    expand: bool = False
    save_matrix: bool = False

    @property
    def files(self) -> tuple[Written, ...]:
        """The map, and its matrix."""
        matrix = [Written("matrix", self.output, (".txt",))] if self.save_matrix else []
        return Written("derotated", self.output, (None,)), *matrix


@dataclass(frozen=True, kw_only=True)
class HeightsOptions(ConvertOptions):
    """Every option of `rollcli heights`.

    Attributes
    ----------
    result : str
        The road of each map, from what `rollcli estimate` wrote; matched by stem.
    preview : str or None
        Also write pictures of the heights, PNG, every frame in the same colours.
    heights_range : tuple of float
        Heights with the outermost colours of a preview, A:B, metres or camera heights.
    save_as : {"tiff", "npy"}
        float32 TIFF, whose description names the unit, or float32 NPY.
    skip_suspect : bool
        Leave out the maps whose angle is suspect.
    """

    result: str
    preview: str | None = None
    heights_range: tuple[float, float] = HEIGHTS_RANGE
    save_as: Literal["tiff", "npy"] = "tiff"

    @property
    def files(self) -> tuple[Written, ...]:
        """The heights, and their picture."""
        heights = Written("heights", self.output, (ENDING_OF_FORMAT[self.save_as],))
        return heights, *_picture(self.preview)


@dataclass(frozen=True, kw_only=True)
class VDisparityOptions(ConvertOptions):
    """Every option of `rollcli vdisparity`: how disparities are counted, None: chosen for each map.

    Attributes
    ----------
    bins : int or None
        Columns of the histogram. [default: one a pixel of disparity for maps of whole pixels, else four
        and at least 256; at most 1024]
    max_disparity : float or None
        Right end of the histogram and its picture, pixels; the last bin also holds what lies beyond.
        [default: just above the map's largest, a few far beyond all others aside]
    counts : bool
        Write the counts too, as a 32-bit TIFF beside the picture, whose description names the right end; a
        row sums to its valid pixels.
    figure : str or None
        Write a figure for a paper in place of the picture: map and v-disparity, as they are and
        de-rotated, with the road's curve, as wide as a journal's column (3.5 inches).
    result : str or None
        The angles and curves of --figure, from what `rollcli estimate` wrote; matched by stem. [default:
        estimate them]
    """

    bins: int | None = None
    max_disparity: float | None = None
    counts: bool = False
    figure: str | None = None

    @property
    def files(self) -> tuple[Written, ...]:
        """The figure or the picture, and the counts."""
        counts = [Written("counts", self.output, (".tif",))] if self.counts else []
        return Written("vdisparity", self.output, (f".{self.figure or 'png'}",)), *counts


@dataclass(frozen=True, kw_only=True)
class DisparityOptions(ConvertOptions):
    """Every option of `rollcli disparity`.

    Attributes
    ----------
    save_as : {"png", "tiff", "npy"}
        16-bit KITTI PNG (TIFF for a map beyond its 256 px), float32 TIFF or float32 NPY. PNG and TIFF carry
        what levelling left uncertain, for `estimate`; NPY cannot.
    preview : str or None
        Also write each map as a picture to look at, in colour with a scale in pixels, PNG.
    """

    save_as: Save = "png"
    preview: str | None = None

    @property
    def paired(self) -> bool:
        """Whether the frames are stereo pairs: always."""
        return True

    @property
    def files(self) -> tuple[Written, ...]:
        """The map, and its picture."""
        maps = ImageOptions(disparity=self.output, save_as=self.save_as).writes(computed=True)
        return *maps, *_picture(self.preview)


@dataclass(frozen=True)
class GateOptions:
    """What the rig must be; None where nothing is asked.

    Attributes
    ----------
    expect_roll : float or None
        The roll must be this, degrees; with --within.
    expect_pitch : float or None
        The pitch must be this, degrees; with --within.
    expect_height : float or None
        The height must be this, metres.
    within : float or None
        How far from what is expected it may be, degrees; of a height metres.
    within_height : float or None
        How far the height may be from what is expected, metres; else as --within.
    max_drift : float or None
        Largest drift of the roll over a drive, degrees.
    max_jump : float or None
        Largest jump of the roll within a drive or from one to the next, degrees.
    max_misalignment : float or None
        Largest vertical shift between the views of a pair anywhere in the image, pixels.
    min_ok : float or None
        Least share of the frames that are ok, 0 to 1.
    """

    expect_roll: float | None = None
    expect_pitch: float | None = None
    expect_height: float | None = None
    within: float | None = None
    within_height: float | None = None
    max_drift: float | None = None
    max_jump: float | None = None
    max_misalignment: float | None = None
    min_ok: float | None = None


@dataclass(frozen=True)
class RigOptions:
    """Everything that `rollcli rig` was asked.

    Attributes
    ----------
    results : tuple of str
        One result or several, or the shards of one run.
    against : str or None
        A later result: say how far the rig has moved until then; checks are of both.
    include_suspect : bool
        Let suspect frames count too.
    groups : str
        Folders that are one drive each, such as 'data/run*'; none: all frames are one drive; auto: each
        folder is a drive, unless folders hold hardly a frame.
    output : str
        Where it goes (-: stdout).
    format : str
        A table to read, or for programs; csv has a line for each segment, from one jump to the next.
        [default: by FILE's ending, else table]
    correction : str or None
        Also write how the right view of the pairs has to be corrected: JSON with the numbers, a 3x3
        matrix and the OpenCV call, for `estimate --align FILE`. Up to 24 of the pairs are matched again,
        to tell how their rows bend, and what of a scale is in the columns.
    calibration : CalibrationOptions
        For what a misalignment does to depth.
    gates : GateOptions
    running : RunningOptions
    """

    results: tuple[str, ...]
    against: str | None = None
    include_suspect: bool = False
    groups: str = "auto"
    output: str = "-"
    format: str = "table"
    correction: str | None = None
    calibration: CalibrationOptions = field(default_factory=CalibrationOptions)
    gates: GateOptions = field(default_factory=GateOptions)
    running: RunningOptions = field(default_factory=RunningOptions)
