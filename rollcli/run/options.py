"""The options of `estimate` and of the conversions. Import-light: the command line loads it for its help."""

import math
import posixpath
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

from rollcli.estimator.request import (
    LAMBDA0,
    MAX_INTERVAL_DEG,
    MAX_ROLL_DEG,
    TOLERANCE_DEG,
    LearningRate,
    Request,
)
from rollcli.rig.calibration import CalibrationOptions
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
    help : str
        Of its option.
    """

    name: str
    holds: Literal["picture", "map", "as input", "numbers"]
    help: str

    def endings(self, save_as: Save, *, computed: bool) -> tuple[str | None, ...]:
        """Return the endings that its files may have, the usual one first; None for that of the input.

        A TIFF takes the place of a KITTI PNG that cannot hold the map. `computed`: from a pair.
        """
        if self.holds == "picture":
            return (ENDING_OF_FORMAT["png"],)
        if self.holds == "numbers":
            return (ENDING_OF_FORMAT["tiff" if save_as == "png" else save_as],)
        if self.holds == "as input" and not computed:
            return (None,)
        formats: tuple[Save, ...] = ("png", "tiff") if save_as == "png" else (save_as,)
        return tuple(ENDING_OF_FORMAT[each] for each in formats)


KINDS = (
    ImageKind("derotated", "as input", "The map rotated upright; type and format of the input."),
    ImageKind(
        "vdisparity",
        "picture",
        "v-disparity of the map rotated upright, with the road, PNG; vdisparity draws maps as they are.",
    ),
    ImageKind("disparity", "map", "The disparity map that was computed from a pair."),
    ImageKind("road_mask", "picture", "The found road, drawn on the left image of a pair or the map, PNG."),
    ImageKind(
        "heights",
        "numbers",
        "Heights over the road, float32 TIFF (--save-as npy: NPY): metres with a calibration that has a "
        "baseline, else camera heights; NaN where there is no disparity.",
    ),
    ImageKind(
        "heights_preview",
        "picture",
        "Heights over the road to look at, over the left image of a pair, PNG; every frame in the same "
        "colours.",
    ),
)

Layout = Literal["left-right", "top-bottom"]
HEIGHTS_RANGE = (-0.10, 0.10)


class InputOptions(NamedTuple):
    """Which maps to read."""

    inputs: tuple[str, ...] = ()
    files_from: str | None = None
    recursive: bool = False
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    sorted: bool = False
    topic: str | None = None
    every: int = 1


class PairOptions(NamedTuple):
    """Which stereo pairs to read, instead of maps. `side_by_side`: how each input holds both views."""

    left: str | None = None
    right: str | None = None
    match: Literal["name", "order"] = "name"
    side_by_side: Layout | None = None


class TopicOptions(NamedTuple):
    """Which views of a bag make pairs, and how far apart their header stamps may be, ms."""

    left_topic: str | None = None
    right_topic: str | None = None
    sync_tolerance: float = 1.0


class EncodingOptions(NamedTuple):
    """How stored numbers become pixels of disparity."""

    encoding: str = "auto"
    scale: float | None = None
    invalid: tuple[float, ...] = ()


class RegionOptions(NamedTuple):
    """Which pixels may be used. `roi` is (x0, y0, x1, y1) in pixels, x1 and y1 excluded."""

    mask: str | None = None
    roi: tuple[int, int, int, int] | None = None
    polygon: tuple[tuple[float, float], ...] | None = None


class MethodOptions(NamedTuple):
    """How the angle is found; `rollcli.estimator.request` has the names."""

    method: str = "gd"
    model: str = "parabola"
    road: str = "auto"
    lambda0: LearningRate = LAMBDA0
    tolerance_deg: float = TOLERANCE_DEG
    max_roll_deg: float = MAX_ROLL_DEG
    max_interval_deg: float = MAX_INTERVAL_DEG
    seed: int = 0

    def request(self, slope_error: float = 0.0) -> Request:
        """Return what is asked of the estimator, in radians; `slope_error`: of the map, px per px."""
        given: dict[str, Any] = {
            name.removesuffix("_deg"): math.radians(value) if name.endswith("_deg") else value
            for name, value in self._asdict().items()
        }
        return Request(**given, slope_error=slope_error)


class ImageOptions(NamedTuple):
    """Which images to write, each of `KINDS` into a folder of its own.

    `heights_range` is what has the outermost colours of a preview, lowest first, in the heights' unit.
    """

    derotated: str | None = None
    vdisparity: str | None = None
    disparity: str | None = None
    road_mask: str | None = None
    heights: str | None = None
    heights_preview: str | None = None
    heights_range: tuple[float, float] = HEIGHTS_RANGE
    save_as: Save = "png"

    def folders(self) -> list[tuple[ImageKind, str]]:
        """List (kind, folder) of the images that were requested."""
        return [(kind, folder) for kind in KINDS if (folder := getattr(self, kind.name)) is not None]

    @property
    def needs_photo(self) -> bool:
        """Whether something is drawn on the left image of a pair."""
        return self.road_mask is not None or self.heights_preview is not None


class RunningOptions(NamedTuple):
    """How the program runs and how much it says.

    `jobs` None: the usable processors. `scheduler`: the address of a Dask cluster to run on instead.
    """

    jobs: int | None = None
    scheduler: str | None = None
    overwrite: bool = False
    dry_run: bool = False
    quiet: bool = False
    verbose: bool = False

    @property
    def root(self) -> str:
        """The folder where relative paths start, for workers on other machines; empty for this one."""
        return str(Path.cwd()) if self.scheduler is not None else ""


class FrameOptions(NamedTuple):
    """What decides the row and the images of a frame: everything that a worker is told beside the frame.

    `root` is the folder where relative paths start, for workers on other machines; empty for this one.
    `replaces` tells whether files that are in the place of an image are replaced. `retry_of` names the result
    whose failed frames are done again; empty otherwise. `notes` tells whether workers say what each frame was
    read from.
    """

    encoding: EncodingOptions = EncodingOptions()
    stereo: StereoOptions = StereoOptions()
    region: RegionOptions = RegionOptions()
    method: MethodOptions = MethodOptions()
    images: ImageOptions = ImageOptions()
    root: str = ""
    replaces: bool = False
    retry_of: str = ""
    notes: bool = False
    side_by_side: Layout | None = None

    def at(self, path: str) -> str:
        """Locate a path on this worker."""
        from rollcli.files.stores.locations import located

        return located(self.root, path)


Form = Literal["csv", "jsonl", "parquet"]
_FORM_OF_ENDING: dict[str, Form] = {".jsonl": "jsonl", ".ndjson": "jsonl", ".parquet": "parquet"}


class ResultOptions(NamedTuple):
    """Where the rows go, and which frames they are of.

    `shard` is (I, N), I from 1: every N-th frame, or one of N runs of consecutive ones, as `shard_by` says.
    An `update` is a `resume` as well.
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


class EstimateOptions(NamedTuple):
    """Every option of `rollcli estimate`."""

    inputs: InputOptions
    pairs: PairOptions
    encoding: EncodingOptions
    stereo: StereoOptions
    region: RegionOptions
    method: MethodOptions
    images: ImageOptions
    result: ResultOptions
    running: RunningOptions
    calibration: CalibrationOptions = CalibrationOptions()
    topics: TopicOptions = TopicOptions()

    @property
    def frame(self) -> FrameOptions:
        """The part that decides the row and the images of a frame."""
        return FrameOptions(
            self.encoding,
            self.stereo,
            self.region,
            self.method,
            self.images,
            self.running.root,
            side_by_side=self.pairs.side_by_side,
        )

    @property
    def paired(self) -> bool:
        """Whether the frames are stereo pairs."""
        return any((*self.pairs[:2], self.pairs.side_by_side, *self.topics[:2]))


@dataclass(frozen=True, kw_only=True)
class ConvertOptions(ABC):
    """What every command is told that makes files of each frame.

    Attributes
    ----------
    inputs : InputOptions
    output : str
        The folder of what is written.
    running : RunningOptions
    encoding, calibration
        How maps are read.
    result : str or None
        Has the row of each map.
    skip_suspect : bool
        Leave out the maps whose row is suspect.
    """

    inputs: InputOptions
    output: str
    running: RunningOptions
    encoding: EncodingOptions = field(default_factory=EncodingOptions)
    calibration: CalibrationOptions = field(default_factory=CalibrationOptions)
    result: str | None = None
    skip_suspect: bool = False

    @property
    def frame(self) -> FrameOptions:
        """How a frame is read, and its files are written."""
        root, replaces = self.running.root, self.running.overwrite
        return FrameOptions(encoding=self.encoding, root=root, replaces=replaces)

    @property
    @abstractmethod
    def writes(self) -> list[tuple[str, str | None]]:
        """Folder and ending of each file that may be written for a frame; None: the frame's own ending."""


@dataclass(frozen=True, kw_only=True)
class DerotateOptions(ConvertOptions):
    """Every option of `rollcli derotate`. `roll_deg` is one angle for all maps, in place of a result."""

    roll_deg: float | None = None
    expand: bool = False
    save_matrix: bool = False

    @property
    def writes(self) -> list[tuple[str, str | None]]:
        """The map, and its matrix."""
        return [(self.output, None), *([(self.output, ".txt")] if self.save_matrix else [])]


@dataclass(frozen=True, kw_only=True)
class HeightsOptions(ConvertOptions):
    """Every option of `rollcli heights`."""

    result: str
    preview: str | None = None
    heights_range: tuple[float, float] = HEIGHTS_RANGE
    save_as: Literal["tiff", "npy"] = "tiff"

    @property
    def writes(self) -> list[tuple[str, str | None]]:
        """The heights, and their picture."""
        picture = [(self.preview, ".png")] if self.preview is not None else []
        return [(self.output, ENDING_OF_FORMAT[self.save_as]), *picture]


@dataclass(frozen=True, kw_only=True)
class VDisparityOptions(ConvertOptions):
    """Every option of `rollcli vdisparity`: how disparities are counted, None: chosen for each map.

    `figure` is the kind of a figure for a paper, in place of the picture: "svg", "pdf" or "png".
    """

    bins: int | None = None
    max_disparity: float | None = None
    counts: bool = False
    figure: str | None = None

    @property
    def writes(self) -> list[tuple[str, str | None]]:
        """The figure; or the picture and the counts."""
        if self.figure is not None:
            return [(self.output, f".{self.figure}")]
        return [(self.output, ".png"), *([(self.output, ".tif")] if self.counts else [])]


@dataclass(frozen=True, kw_only=True)
class DisparityOptions(ConvertOptions):
    """Every option of `rollcli disparity`."""

    pairs: PairOptions
    topics: TopicOptions = field(default_factory=TopicOptions)
    stereo: StereoOptions = field(default_factory=StereoOptions)
    save_as: Save = "png"
    preview: str | None = None

    @property
    def frame(self) -> FrameOptions:
        """How a pair is matched: levelled as the estimate does, then every row."""
        images = ImageOptions(disparity=self.output)
        layout = self.pairs.side_by_side
        return super().frame._replace(stereo=self.stereo, images=images, side_by_side=layout)

    @property
    def writes(self) -> list[tuple[str, str | None]]:
        """The map, the TIFF in place of a PNG that cannot hold it, and last the picture."""
        maps = [(self.output, ENDING_OF_FORMAT[self.save_as])]
        maps += [(self.output, ENDING_OF_FORMAT["tiff"])] if self.save_as == "png" else []
        return [*maps, *([(self.preview, ".png")] if self.preview is not None else [])]


@dataclass(frozen=True)
class GateOptions:
    """What the rig must be; None where nothing is asked.

    Attributes
    ----------
    expect_roll, expect_pitch : float or None
        Degrees.
    expect_height : float or None
        Metres.
    within : float or None
        How far from them the rig may be, degrees; of the height metres, unless `within_height` is given.
    within_height : float or None
        Metres.
    max_drift, max_jump : float or None
        Of the roll, degrees; the drift over a drive.
    max_misalignment : float or None
        Largest vertical shift between the views in the image, px.
    min_ok : float or None
        Share of the frames that are ok, 0 to 1.
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
        A later result to compare with.
    include_suspect : bool
    groups : str
        "auto", "none" or a pattern of folders.
    output, format : str
    correction : str or None
        Where to write how the right view has to be corrected.
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
