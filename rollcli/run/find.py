"""Find the frames that a user named, and the calibration of each."""

import contextlib
import glob
import itertools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, overload

from rollcli.errors import InputError, UsageError, as_usage
from rollcli.extras import require_extra
from rollcli.files.atomic import is_file
from rollcli.files.bounded import as_utf8
from rollcli.files.containers import (
    BAGS,
    VIDEOS,
    bag_files,
    file_of,
    frame_name,
    has_doffs,
    is_archive,
    is_rest,
    is_video,
    shown,
)
from rollcli.files.inputs import Manifest, find_inputs, named_input, pair_inputs
from rollcli.files.naming import Input, gathered, natural_key
from rollcli.files.search import IMAGE_ENDINGS, LEAVE_NONE, MAP_ENDINGS, Search, is_place
from rollcli.files.storage import fetch_all, read_bytes
from rollcli.files.stores.locations import is_url, names_a_file, public_name
from rollcli.messages import listed
from rollcli.rig.calibration import Calibration, CalibrationOptions, require_calibration
from rollcli.rig.read_calibration import MAX_BYTES, parse_calibration, with_numbers
from rollcli.run.frame import Frame
from rollcli.run.options import FramesOptions, InputOptions, Layout

if TYPE_CHECKING:
    from rollcli.files.recordings.frames import Bags

_TRIED = 8  # frames, until one can be read
_MARK = "_camera"  # Cityscapes: aachen_000000_000019_camera.json


def read_calibration(path: str | os.PathLike[str], *right: str | os.PathLike[str]) -> Calibration:
    """Read the calibration of a rectified stereo pair.

    Parameters
    ----------
    path : str or path
        A file of KITTI, Middlebury, ETH3D, OpenCV, ROS, Cityscapes, ORB-SLAM or DrivingStereo, recognised by
        its content.
    *right : str or path
        The file of the right view, where each view has one (ROS).

    Returns
    -------
    Calibration
        Lengths in metres, the rest in pixels.

    Raises
    ------
    InputError
        A file cannot be read, is of no known format, or contradicts itself.
    UsageError
        What it says is not enough for a pose, or cannot be a rig.

    Examples
    --------
    A calibration in KITTI's form, of cameras half a metre apart:

    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp(), "calib.txt")
    >>> left, right = "700 0 600 0 0 700 180 0 0 0 1 0", "700 0 600 -350 0 700 180 0 0 0 1 0"
    >>> characters = file.write_text(f"P0: {left}\\nP1: {right}\\n")
    >>> found = read_calibration(file)
    >>> found.fx, found.cy, found.baseline
    (700.0, 180.0, 0.5)
    """
    return _read([os.fspath(each) for each in (path, *right)], CalibrationOptions())


def given_calibration(calibration: Calibration | str | os.PathLike[str] | None) -> Calibration | None:
    """Return the calibration that was given as it is, or as the path of its file; see `read_calibration`."""
    if isinstance(calibration, str | os.PathLike):
        return read_calibration(calibration)
    require_calibration(calibration)
    return calibration


def calibration_finder(given: CalibrationOptions) -> Callable[[str], Calibration | None]:
    """Return what finds the calibration of a frame by its name: what a user said of it is found and read.

    One is for all frames; of a folder it is that of the frame's stem, or of the stem up to one of its
    underscores. What finds it raises InputError where the frame's own file is damaged.

    Raises
    ------
    UsageError, InputError
        See `parse_calibration`; or there is no such file.
    """
    if len(given.calib) != 1 or not is_place(given.calib[0]):
        one = _read(given.calib, given) if given.given else None
        return lambda name: one
    files = _files(given.calib[0])
    by_stem = gathered((_stem(shown(path)).removesuffix(_MARK), path) for path in files)
    fetched = fetch_all(filter(is_url, files), MAX_BYTES)  # one after the other takes long

    @cache  # one may be for a thousand frames
    def read(path: str) -> Calibration | InputError:
        try:
            return _read([path], given, fetched)
        except (InputError, UsageError) as error:  # which is of its own frames alone
            return InputError(str(error))

    def of(name: str) -> Calibration | None:
        if _is_broken(name):
            return None
        stem = _stem(name)
        while stem not in by_stem and "_" in stem:  # KITTI's 000010.txt is for 000010_10.png
            stem = stem.rpartition("_")[0]
        found = read(_only(by_stem, stem, "calibration", name, given.calib[0]))
        if isinstance(found, InputError):
            raise found.with_traceback(None)
        return found

    return of


def mask_finder(mask: str | None) -> Callable[[str], str | None]:
    """Return what finds the mask of a frame by its name: none, one for all, or of a folder that of its stem.

    Raises
    ------
    UsageError
        There is no such file or folder, or a store does not give it.
    """
    if mask is not None and is_place(mask):
        found = find_inputs([mask], Search(recursive=True))
        by_stem = gathered((_stem(each.name), each.location) for each in found)
        return lambda name: None if _is_broken(name) else _only(by_stem, _stem(name), "mask", name, mask)
    if mask is not None and is_url(mask):
        with as_usage():
            read_bytes(mask)
    elif mask is not None and not is_file(file_of(mask)):
        raise UsageError(f"{mask}: no such mask file or folder")
    return lambda name: mask


def _stem(name: str) -> str:
    """Return a frame's name without folders and ending."""
    return PurePosixPath(frame_name(name)).stem


def _is_broken(name: str) -> bool:
    """Tell whether this is no frame but a row's error: a damaged archive, or the rest of a recording."""
    return is_archive(name) or is_rest(name)


def _only(by_stem: Mapping[str, Sequence[str]], stem: str, what: str, name: str, folder: str) -> str:
    """Return the one path of a stem; which of several is meant for a frame, nobody can tell."""
    paths = by_stem.get(stem, ())
    if not paths:
        raise UsageError(f"{name}: has no {what} of its name in {folder}")
    if len(paths) > 1:
        raise UsageError(f"{name}: has more than one {what} of its name: {listed(map(shown, paths))}")
    return paths[0]


def calibration_files(given: CalibrationOptions) -> list[str]:
    """List the files that a user named, those of a folder one by one."""
    return [shown(path) for name in given.calib for path in (_files(name) if is_place(name) else [name])]


def calibration_notes(frames: Sequence[Frame]) -> list[str]:
    """List what the user should know about how the calibrations were read, each once."""
    used = dict.fromkeys(frame.calibration for frame in frames if frame.calibration is not None)
    return list(dict.fromkeys(note for calibration in used for note in calibration.notes))


def check_first_size(frames: Sequence[Frame], options: FramesOptions) -> Calibration | None:
    """Refuse a calibration that is not for the size of the first frame, and say what speaks against it.

    The first is that which can be read, as far as one of the first few can.

    Returns
    -------
    Calibration or None
        Of its map, whose sides may have been rounded; None where that cannot be told.

    Raises
    ------
    UsageError
        So it is; or every calibration is damaged; or views side by side seem squeezed, and no calibration
        says that they are not.
    """
    sound = (frame for frame in frames if not frame.damaged)
    layout, tried = options.pairs.side_by_side, list(itertools.islice(sound, _TRIED))
    if not tried:
        raise UsageError(frames[0].damaged)
    if layout is None and all(frame.calibration is None for frame in tried):
        return None
    from rollcli.run.read import read_map, read_views, size_of_images  # only here are images decoded
    from rollcli.stereo.views import matched_shape

    for first in tried:
        with contextlib.suppress(InputError):  # its row will say so
            matched: tuple[int, ...]
            if first.right_file:
                height, width = read_views(first, options)[0].shape[:2]
                matched = matched_shape((height, width), options.stereo.downscale)
            else:
                stored = read_map(first, options)
                matched, (width, height) = stored.values.shape, size_of_images(stored)
            break
    else:
        return None
    fitting = None if first.calibration is None else first.calibration.for_size(width, height)
    if width < height and layout == "left-right" and (fitting is None or fitting.at_edge):
        raise UsageError(
            f"{first.file}: its views would be {width}x{height} px, higher than wide, as where both are "
            "squeezed into one image, which changes angles: stretch them to twice their width, or give "
            "estimate --calib, or --focal and --principal-point, of the views as they are"
        )
    if first.calibration is None or fitting is None:
        return None
    if doubt := first.calibration.seems_of_another_size(width, height):
        options.running.note(doubt)
    return fitting.for_size(*reversed(matched))


def check_depth(frames: Sequence[Frame], options: FramesOptions) -> None:
    """Refuse depth maps without the calibration that turns their numbers into disparities.

    Raises
    ------
    UsageError
    """
    used = (frame.calibration for frame in frames if not (_is_broken(frame.file) or frame.damaged))
    lacking = (calibration is None or calibration.baseline is None for calibration in used)
    if options.encoding.encoding == "depth" and not options.paired and any(lacking):
        raise UsageError(
            "--encoding depth needs a focal length and a baseline, which turn a depth into a disparity: "
            "give --calib, or what is missing of --focal, --principal-point and --baseline"
        )


def _files(folder: str) -> list[str]:
    """List the files of a folder of calibrations; maps and views may lie beside them."""
    found = (each.location for each in find_inputs([folder], Search(("",), recursive=True)))
    return [path for path in found if not path.lower().endswith((*MAP_ENDINGS, *IMAGE_ENDINGS))]


def _read(
    paths: Sequence[str], given: CalibrationOptions, fetched: Mapping[str, bytes] | None = None
) -> Calibration:
    if len(paths) > 2:
        raise UsageError("--calib is given at most twice: for the left and the right view of ROS")
    names = [shown(public_name(path)) for path in paths]
    data = [(fetched or {}).get(path) or read_bytes(path, most=MAX_BYTES) for path in paths]
    return parse_calibration([*zip(names, map(as_utf8, data, names), strict=True)], given)


# a frame's left view or map, its right view, and the calibration of its bag
_Named = tuple[Input, Input | None, Calibration | None]


def find_frames(options: FramesOptions) -> Sequence[Frame]:
    """Make a frame of each map, or of each stereo pair, that a user named.

    Raises
    ------
    UsageError
        Nothing is named or found, pairs are named in several ways, an image has no partner, a mask or a
        calibration is missing, or names are not sorted that should be.
    """
    given = options.inputs
    if given.sorted:
        return _sorted_frames(options)
    make, numbers = _frame_maker(options), itertools.count()
    named = _pairs(options) if options.paired else _maps(options)
    # what is broken is always taken
    return [make(*each) for each in named if _is_broken(each[0].location) or next(numbers) % given.every == 0]


def _maps(options: FramesOptions) -> Iterator[_Named]:
    """Find the maps: files, or those of a bag."""
    given = options.inputs
    if not (given.inputs or given.files_from):
        raise UsageError("no input: name maps (files, folders, patterns, or - for a list on stdin)")
    if bags := _bags(given):
        yield from _in_bags(bags, options)
        return
    if given.topic is not None:
        raise UsageError("--topic is of a bag (.bag, .db3, .mcap or a rosbag2 folder), and none is given")
    search = _search(options, MAP_ENDINGS, maps=True)
    found = find_inputs(given.inputs, search, files_from=given.files_from)
    options.running.note(*search.notes)
    if video := next((each.name for each in found if is_video(each.location)), None):
        raise UsageError(
            f"{video}: is a video, of views and not of maps: give --side-by-side (estimate, disparity) "
            "where its frames hold both, or --left and --right with a video each"
        )
    yield from ((each, None, None) for each in found)


def _search(options: FramesOptions, endings: tuple[str, ...], *, maps: bool = False) -> Search:
    given = options.inputs
    return Search(endings, given.recursive, given.include, given.exclude, options.folders, maps)


def _sorted_frames(options: FramesOptions) -> "SortedFrames":
    given = options.inputs
    if options.paired:
        raise UsageError("--sorted takes a list of maps, not of pairs")
    if given.inputs or given.files_from is None or given.files_from == "-" or is_url(given.files_from):
        raise UsageError("--sorted takes the names of one file on disk: give --files-from FILE and no input")
    if given.recursive or given.include or given.exclude:
        raise UsageError("--sorted takes the names as they are: leave out --recursive, --include, --exclude")
    manifest = Manifest(given.files_from)
    places = range(0, len(manifest), given.every)
    return SortedFrames(manifest, _frame_maker(options), places)


class SortedFrames(Sequence[Frame]):
    """The frames of a manifest, made when they are asked for; a slice of them is another such sequence."""

    def __init__(self, manifest: Manifest, make: Callable[..., Frame], places: range) -> None:
        self._manifest, self._make, self._places = manifest, make, places

    def __len__(self) -> int:
        return len(self._places)

    def __iter__(self) -> Iterator[Frame]:
        for name in self._manifest.names(self._places):
            yield self._make(named_input(name))

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> "SortedFrames": ...

    def __getitem__(self, index: int | slice) -> "Frame | SortedFrames":
        if isinstance(index, int):
            return next(iter(self[index : index + 1 or None]))
        return SortedFrames(self._manifest, self._make, self._places[index])


def _pairs(options: FramesOptions) -> Iterator[_Named]:
    """Find the pairs: of two places, of topics of bags, or of images that hold both views."""
    given, pairs, topics = options.inputs, options.pairs, options.topics
    has_inputs = bool(given.inputs or given.files_from)
    sides, views = (pairs.left, pairs.right), (topics.left_topic, topics.right_topic)
    ways = [any(sides), any(views), pairs.side_by_side is not None]
    if sum(ways) != 1 or has_inputs is any(sides):
        raise UsageError(
            "name pairs in one way: --left and --right alone; or INPUTS, with --left-topic and --right-topic "
            "for bags, or --side-by-side for images and videos that hold both views"
        )
    if any(views):
        if not all(views):
            raise UsageError("--left-topic and --right-topic are given together")
        if not (bags := _bags(given)):
            raise UsageError(
                "--left-topic and --right-topic are of a bag: name a .bag, .db3, .mcap or rosbag2 folder"
            )
        yield from _in_bags(bags, options)
        return
    videos = VIDEOS if pairs.side_by_side is not None else ()
    search = _search(options, (*IMAGE_ENDINGS, *videos))
    if pairs.side_by_side is not None:
        found = find_inputs(given.inputs, search, files_from=given.files_from)
        matched = [(each, each) for each in found]
    elif pairs.left is None or pairs.right is None:
        raise UsageError("--left and --right are given together")
    else:
        matched = pair_inputs(pairs.left, pairs.right, search, match=pairs.match)
    alone = len(matched) == 1
    both = [views for pair in matched for views in _frames_of(*pair, pairs.side_by_side, alone=alone)]
    options.running.note(*search.notes)
    yield from ((left, right, None) for left, right in both)


def _frames_of(left: Input, right: Input, layout: Layout | None, *, alone: bool) -> list[tuple[Input, Input]]:
    """List the frames of two videos, or of one that holds both views; images are a pair themselves.

    Unless it is alone, a video of both views that cannot be used is one frame, which fails and says why.
    """
    if not (is_video(left.location) or is_video(right.location)):
        return [(left, right)]
    if packed := next((each.name for each in (left, right) if file_of(each.location) != each.location), None):
        raise UsageError(f"{packed}: is a video in an archive: unpack it")
    from rollcli.files.recordings.video import frames_of

    try:
        return frames_of(left, right, layout)
    except InputError as error:
        if alone or layout is None:
            raise UsageError(str(error)) from error
        rest = named_input(f"{left.location}#rest")
        return [(rest, rest)]


def _bags(given: InputOptions) -> "Bags":
    """List the bags among the inputs, in natural order, each once; all inputs are bags, or none is.

    Raises
    ------
    UsageError
        Some are, or one is in a store, or --include and --exclude leave none, or the extra is missing.
    """
    named = dict.fromkeys(each for name in given.inputs for each in _behind(name))
    bags = [(name, files) for name in named if (files := bag_files(name))]
    if bags and (len(bags) < len(named) or given.files_from is not None):
        raise UsageError(f"{bags[0][0]}: is a bag: give bags and other inputs in runs of their own")
    if bags:
        require_extra("bags", bags[0][0])
    search = Search(include=given.include, exclude=given.exclude)
    allowed = {os.path.realpath(each[0]): each for each in bags[::-1] if search.allows(each[0].rstrip("/"))}
    if bags and not allowed:
        raise UsageError(f"no input found: {LEAVE_NONE} of the named bags")
    return sorted(allowed.values(), key=lambda each: natural_key(each[0]))


def _behind(name: str) -> list[str]:
    """List the bags that a pattern finds; of anything else the name itself."""
    pattern = name.lower().endswith(BAGS) and not os.path.lexists(name)
    found = glob.glob(name, recursive=True) if pattern else []  # noqa: PTH207 (as in a search)
    return sorted(found) or [name]


def _in_bags(bags: "Bags", options: FramesOptions) -> Iterator[_Named]:
    from rollcli.files.recordings.frames import frames_of_bag, readable_bags

    bags, rests = readable_bags(bags)
    for bag in [frames_of_bag(files, name, options.inputs.topic, *options.topics) for name, files in bags]:
        known, given = bag.calibration, options.calibration
        lacks = [] if given.given or not options.calibrates else bag.uncalibrated
        options.running.note(*bag.notes, *lacks)
        known = None if known is None or given.calib else with_numbers(known, given)
        yield from ((*views, known) for views in bag.frames)
    yield from ((rest, rest if options.paired else None, None) for rest in rests)


def _frame_maker(options: FramesOptions) -> Callable[..., Frame]:
    """Return what makes frames, with the masks and calibrations that were named: one, or one of each stem."""
    mask_of = mask_finder(options.region.mask)
    calibration_of = cache(lambda: calibration_finder(options.calibration))  # not where bags have their own
    doffs = options.calibration.doffs
    # doffs would take all that is farther than fB / doffs from a map that is computed of depths
    of_depths = options.encoding.encoding == "depth" and not options.paired

    def frame(left: Input, right: Input | None = None, calibration: Calibration | None = None) -> Frame:
        # what is made of an input must stay in its folder, whatever a store or an archive calls it
        foreign = is_url(left.location) or file_of(left.location) != left.location
        known, damaged = calibration, ""
        if known is None:
            find = calibration_of()  # a file that is for all frames is refused
            try:
                known = find(left.name)
            except InputError as error:
                damaged = str(error)
        if known and known.doffs and (of_depths or (doffs is None and has_doffs(left.location))):
            known = replace(known, doffs=0.0)
        return Frame(
            file=left.name,
            right_file=right.name if right else "",
            path=left.location,
            right_path=right.location if right else "",
            relative=left.relative if not foreign or names_a_file(left.relative) else "",
            mask=mask_of(left.name),
            calibration=known,
            damaged=damaged,
        )

    return frame
