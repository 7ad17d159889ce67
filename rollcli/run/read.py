"""Read a frame: its disparity, from a map or matched from a pair, and the pixels that may be used."""

import contextlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rollcli.errors import EstimationError, InputError, UsageError, about, raised_at
from rollcli.estimator.estimate import RollEstimate
from rollcli.estimator.request import Request
from rollcli.estimator.road.find import Plane, road_plane
from rollcli.files.codecs.pictures import views_of
from rollcli.files.encodings import Encoding, to_disparity
from rollcli.files.formats import Stored, decode_mask, read_image, read_stored
from rollcli.files.results import ALIGNMENT_COLUMNS, Row
from rollcli.files.storage import noting, read_bytes, state_of
from rollcli.messages import one_line, printable
from rollcli.rig.calibration import Calibration, one_factor
from rollcli.run.diagnosis import not_pixels, require_positive
from rollcli.run.frame import Decoded, Frame, FrameResult, ReadAs, failed_frame
from rollcli.run.options import FramesOptions, RegionOptions
from rollcli.stereo.correction import LARGEST
from rollcli.stereo.options import StereoOptions

if TYPE_CHECKING:
    from rollcli.stereo.along_road import FindRoad
    from rollcli.stereo.match import StereoMatch
    from rollcli.stereo.views import Views


def region_mask(mask: str | None, options: FramesOptions, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
    """Find the pixels inside all that is given, shape (H, W); None when nothing is given.

    Raises
    ------
    InputError
        The mask cannot be read or has another size, or no pixel is left.
    """
    region = options.region
    if mask is None and region.roi is None and region.polygon is None:
        return None
    allowed = _drawn(region, shape)
    if mask is not None:
        usable = _mask_file(options.at(mask), mask, state_of(options.at(mask)) or options.run)
        if usable.shape != shape:
            raise InputError(f"the mask {mask} is {_size(usable.shape)}, the map {_size(shape)}")
        allowed = allowed & usable
    if not allowed.any():
        raise InputError(f"no pixel of this {_size(shape)} map lies inside the mask, --roi and --polygon")
    return allowed


@lru_cache(maxsize=4)  # the maps of a batch have one size, or a few
def _drawn(options: RegionOptions, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    inside = np.zeros(shape, np.uint8)
    x0, y0, x1, y1 = options.roi or (0, 0, shape[1], shape[0])
    inside[y0:y1, x0:x1] = 1
    if options.polygon is not None:
        area: NDArray[Any] = np.zeros(shape, np.uint8)
        cv2.fillPoly(area, [np.rint(options.polygon).astype(np.int32)], 1)
        inside &= area
    return inside.astype(np.bool_)


@lru_cache(maxsize=1)  # a mask for all frames is read once, unless it changes: workers outlive runs
def _mask_file(path: str, name: str, state: str) -> NDArray[np.bool_]:
    return decode_mask(read_bytes(path, name), name)


def _size(shape: tuple[int, ...]) -> str:
    return "x".join(map(str, reversed(shape)))


_LACKS_ROAD = "matched over the whole range, as too little road was found to match along"


@dataclass(frozen=True)
class Source:
    """The disparity of a frame, where it comes from, and which pixels of it may be used.

    Attributes
    ----------
    disparity : ndarray, shape (H, W)
        What the angle is estimated from; pixels, 0 is no data.
    allowed : ndarray of bool, shape (H, W), or None
        Pixels inside the mask, --roi and --polygon; None when none of them is given.
    stored : Stored or None
        What the map file holds; None for a pair.
    encoding : str
        How the stored numbers were read.
    warnings : mapping of str to str
        Why that may be wrong, by code; "beyond": the disparities cannot be pixels.
    searched : tuple of int, or None
        First and last disparity searched, px; pairs only.
    slope_error : float
        Standard deviation of a slope that all disparities may have beside the road's, px per px.
    doubts : mapping of str to str
        Why the map itself may be wrong, by code.
    note : str
        What else a row says of the map; no reason for doubt.
    alignment : mapping of str to float
        How the right view lay, by column of a result; empty for a map, and where that could not be told.
    levelled : tuple of float
        By which share the right view was made smaller, and how far it was turned counter-clockwise, radians:
        both about the middle of the image.
    size : tuple of int, or None
        Width and height of the images in the files, px, where the map was matched from them.
    match : StereoMatch or None
        Of a pair: it has the map with all rows at full size, which images show.
    photo : ndarray or None
        The left image of a pair, grey or BGR, where something is to be drawn on it.
    """

    disparity: NDArray[Any]
    allowed: NDArray[np.bool_] | None = None
    stored: Stored | None = None
    encoding: str = ""
    warnings: Mapping[str, str] = field(default_factory=dict)
    searched: tuple[int, int] | None = None
    slope_error: float = 0.0
    doubts: Mapping[str, str] = field(default_factory=dict)
    note: str = ""
    alignment: Mapping[str, Any] = field(default_factory=dict)
    levelled: tuple[float, float] = (0.0, 0.0)
    size: tuple[int, int] | None = None
    match: "StereoMatch | None" = None
    photo: NDArray[Any] | None = None

    def require_size(self, file: str, row: Row | None, result: str = "") -> "Source":
        """Return the source, unless its row is of a map of another size: that road is not this map's.

        Raises
        ------
        InputError
        """
        shape = self.disparity.shape
        if row is not None and row.width is not None and (row.height, row.width) != shape:
            raise InputError(
                f"{file}: has {_size(shape)} px, its row{result} {row.width}x{row.height}: "
                "name the result of these maps"
            )
        return self

    def doubted(self, estimate: RollEstimate, likeness: str = "", note: str = "") -> RollEstimate:
        """Return an estimate whose message has all that the row says; it is suspect where the map is."""
        doubt = "; ".join(filter(None, self.doubts.values()))
        said = filter(None, [likeness, estimate.message, doubt, self.note, note])
        status = "suspect" if doubt else estimate.status
        return replace(estimate, status=status, message="; ".join(said))

    @contextlib.contextmanager
    def doubting(self) -> Iterator[None]:
        """Add the doubts to what an estimate fails with: they may be why."""
        try:
            yield
        except EstimationError as error:
            raise EstimationError("; ".join([str(error), *self._doubts_of_map])) from error

    @property
    def _doubts_of_map(self) -> list[str]:
        """All but that numbers cannot be pixels: that is of the pose, and seen by all readers."""
        return [text for code, text in self.doubts.items() if text and code != "beyond"]

    @property
    def text(self) -> str:
        """What a file of the map carries, one line of ASCII (see `_carried`); empty where that is nothing."""
        doubt = "; ".join(self._doubts_of_map)
        height, width = self.disparity.shape
        size = None if self.size == (width, height) else self.size
        if not (self.slope_error or doubt or self.alignment or size):
            return ""
        carried = {"slope_error": self.slope_error, "doubt": doubt, "alignment": self.alignment}
        return json.dumps({**carried, "levelled": self.levelled, **({"size": size} if size else {})})

    def calibrated(self, calibration: Calibration | None) -> Calibration | None:
        """Return the calibration of the map, from that of the images in the files; none stays none.

        Its `doffs` has what levelling has put into all disparities: a right camera that is rolled, or of a
        longer focal length, turns and enlarges its view about the principal point, and levelling undoes that
        about the middle of the image.

        Raises
        ------
        UsageError
            It is of another view: see `Calibration.for_size`.
        """
        if calibration is None:
            return None
        if self.size is not None:
            calibration = calibration.for_size(*self.size)
        height, width = self.disparity.shape
        calibration = calibration.for_size(width, height)
        larger, clockwise = self.levelled
        right, below = calibration.right_axis(width, height)
        return replace(calibration, doffs=calibration.doffs + clockwise * below - larger * right)

    @property
    def read_as(self) -> ReadAs:
        """How it was read or matched."""
        downscale = 1.0 if self.size is None else self.size[0] / self.disparity.shape[1]
        return ReadAs(frozenset(filter(None, [self.encoding])), self.searched, downscale)

    @property
    def shown(self) -> NDArray[Any]:
        """The map that images show, px, shape (H, W)."""
        return self.disparity if self.match is None else self.match.whole


def read_source(frame: Frame, options: FramesOptions) -> Source:
    """Read the frame's map, or match its pair, and draw its region.

    Raises
    ------
    InputError
        A file cannot be read as what it should be, also that of its calibration; or no pixel may be used.
    """
    if not frame.relative:
        raise InputError(
            f"{frame.file}: its name in the store or archive names no file below a folder, by which "
            "what is made of it could be named"
        )
    if frame.damaged:
        raise InputError(frame.damaged)
    if frame.right_file:
        return _match(frame, options)
    source = _read(frame, options)
    allowed = region_mask(frame.mask, options, source.disparity.shape)
    return source if allowed is None else replace(source, allowed=allowed)


def read_map(frame: Frame, options: FramesOptions) -> Stored:
    """Read the numbers of a map as they are stored."""
    rgb = options.encoding.encoding == Encoding.FOUNDATIONSTEREO
    return read_stored(options.at(frame.path), frame.file, rgb=rgb)


def _read(frame: Frame, options: FramesOptions) -> Source:
    stored, given = read_map(frame, options), options.encoding
    if given.scale is None or given.scale > 0:
        require_positive(stored, frame.file)
    with about(frame.file):
        found = to_disparity(stored, **given._asdict(), calibration=frame.calibration)
    encoding = found.encoding.value
    told = found.warnings.get("encoding")
    beyond = {"beyond": told or not_pixels(found.disparity, stored, encoding)}
    warnings = found.warnings if told else {**found.warnings, **beyond}
    source = Source(found.disparity, stored=stored, encoding=encoding, warnings=warnings, **_carried(stored))
    # the roll is the same at any scale, pitch and height are not
    return source if frame.calibration is None else replace(source, doubts={**source.doubts, **beyond})


def size_of_images(stored: Stored) -> tuple[int, int]:
    """Return the width and height of the images that a map was matched from, as far as its file says, px."""
    height, width = stored.values.shape
    return _carried(stored).get("size") or (width, height)


def _carried(stored: Stored) -> dict[str, Any]:
    """Read how a map was made: slope error, doubts, alignment, levelling and size of a `Source`.

    Nothing is known where another program has written or changed its file, or where no rig has such numbers.
    """
    try:
        carried = json.loads(stored.text)
        error, doubt, lay = float(carried["slope_error"]), carried["doubt"], carried["alignment"]
        alignment = {name: float(lay[name]) for name in ALIGNMENT_COLUMNS if name in lay}
        larger, clockwise = map(float, carried.get("levelled", (0.0, 0.0)))  # earlier files have none
        width, height = map(int, carried.get("size", (0, 0)))  # where it is not the map's own
        # else the map was turned with --expand: its sides are not those of the images, but for one factor
        same_view = min(width, height) > 0 and one_factor(stored.values.shape[::-1], (width, height))
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return {}
    most = dict(zip(ALIGNMENT_COLUMNS, LARGEST, strict=False))
    levelled = ("right_larger_percent", 100 * larger), ("right_clockwise_deg", math.degrees(clockwise))
    fits = all(abs(value) <= most[name] for name, value in (*alignment.items(), *levelled))
    if not (0 <= error < math.inf and isinstance(doubt, str) and fits):
        return {}
    return {
        "slope_error": error,
        "doubts": {"carried": printable(one_line(doubt))},
        "alignment": alignment,
        "levelled": (larger, clockwise),
        "size": (width, height) if same_view else None,
    }


def _match(frame: Frame, options: FramesOptions) -> Source:
    from rollcli.stereo.views import matched_shape

    left, right = read_views(frame, options)
    allowed = region_mask(frame.mask, options, matched_shape(left.shape, options.stereo.downscale))
    find_road = road_finder(allowed, options.method.request())
    source = matched_source((left, right), options.stereo, find_road, frame.calibration)
    drawn_on = options.images.road_mask is not None or options.images.heights_preview is not None
    return replace(source, photo=left if drawn_on else None, allowed=allowed)


def read_views(frame: Frame, options: FramesOptions) -> tuple[NDArray[Any], NDArray[Any]]:
    """Read the left and the right view of a pair: of two images, or of one that holds both."""
    if frame.decoded is not None:
        return frame.decoded.views
    left = read_image(options.at(frame.path), frame.file)
    if (layout := options.pairs.side_by_side) is not None:
        return views_of(left, layout, frame.file)
    return left, read_image(options.at(frame.right_path), frame.right_file)


def decoded(frame: Frame, options: FramesOptions) -> Frame:
    """Read the views of a frame of videos before it is handed out; see `Work.prepare`.

    One that cannot be read stays as it is: the worker that gets it says why.
    """
    if frame.of_videos:
        with contextlib.suppress(*FRAME_ERRORS), noting(options.notes) as notes:
            return frame._replace(decoded=Decoded(read_views(frame, options), notes))
    return frame


_MOST_SEARCHED = 0.75  # of the width: hardly a road is matched in what is left


def matched_source(
    views: "Views", options: StereoOptions, find_road: "FindRoad | None", rig: Calibration | None
) -> Source:
    """Match a pair for the estimate; see `match_pair`."""
    from rollcli.stereo.match import MUCH_AT_END, match_pair

    match = match_pair(*views, options, find_road, rig)
    if not np.any(match.disparity):
        raise InputError("no pixel could be matched with the right image")
    height, width = views[0].shape[:2]
    searched = (match.min_disparity, match.min_disparity + match.num_disparities - 1)
    at_end = f"{match.end_fraction:.0%} of the map lies at the end of the searched range"
    short = f"{at_end}; use a larger --num-disparities" if match.end_fraction > MUCH_AT_END else ""
    if searched[1] > _MOST_SEARCHED * (columns := match.disparity.shape[1]):
        lost = f"the left {searched[1] + 1} of {columns} columns are not matched in so wide a searched range"
        short = f"{lost}; use a smaller --num-disparities"
    alignment = {}
    if match.lies is not None:  # rounded: a resumed run reads them from its rows
        lies = zip(ALIGNMENT_COLUMNS, match.lies.values(*match.disparity.shape), strict=True)
        alignment = {name: round(each, 4) for name, each in lies}
    return Source(
        match.disparity,
        searched=searched,
        slope_error=match.slope_error,
        doubts={"range": short, "match": match.doubt},
        note=_LACKS_ROAD if match.lacks_road else "",
        alignment=alignment,
        levelled=(round(match.larger, 8), round(match.corrected.rotation, 8)),
        size=(width, height),
        match=match,
    )


def road_finder(allowed: NDArray[np.bool_] | None, request: Request) -> "FindRoad | None":
    """Return what finds the road of a pair, if that is asked; `allowed` has the shape that is matched at."""

    def find(small: NDArray[Any], smaller: float) -> Plane | None:
        usable = None
        if allowed is not None:
            v, u = (np.arange(n) * of // n for n, of in zip(small.shape, allowed.shape, strict=True))
            usable = allowed[v[:, None], u]
        return road_plane(small, smaller, usable, request)

    return find if request.road == "auto" else None


_NUMERIC_ERRORS = (ArithmeticError, ValueError)  # from numbers that some step cannot deal with
FRAME_ERRORS = (InputError, EstimationError, UsageError, OSError, MemoryError, cv2.error, *_NUMERIC_ERRORS)


def frame_of_error(frame: Frame, error: Exception) -> FrameResult:
    """Make the row of a frame that an error has cost."""
    unsaid = "out of memory" if isinstance(error, MemoryError) else type(error).__name__
    return failed_frame(frame, str(error) or unsaid, _cause_of(error))


def _cause_of(error: BaseException | None) -> str:
    """Return what errors of one cause share: where they, and what led to them, were raised, and why."""
    places = []
    while error is not None:
        last = raised_at(error)
        where = f"{last.tb_frame.f_globals['__name__']}:{last.tb_lineno}" if last else ""
        why = getattr(error, "code", "") or getattr(error, "errno", "")
        places.append(f"{type(error).__name__} {why} {where}")
        error = error.__cause__
    return " of ".join(places)
