"""Find the frames that a user named."""

import contextlib
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, NamedTuple, overload

from rollcli.errors import UsageError
from rollcli.extras import require_extra
from rollcli.files.atomic import is_file
from rollcli.files.containers import BAGS, VIDEOS, bag_files, file_of, frame_name, is_video
from rollcli.files.inputs import Input, Manifest, Pair, find_inputs, named_input, pair_inputs
from rollcli.files.search import IMAGE_ENDINGS, MAP_ENDINGS, Search, is_place
from rollcli.files.stores.locations import is_url, names_a_file, public_name
from rollcli.messages import say
from rollcli.rig.calibration import CalibrationOptions
from rollcli.run.calibration import Calibrations
from rollcli.run.frame import Frame
from rollcli.run.options import InputOptions, Layout, PairOptions, RegionOptions, TopicOptions

if TYPE_CHECKING:
    from rollcli.files.recordings.frames import BagFrames, RecordingFrame


class Named(NamedTuple):
    """What a user named: where frames are, and what belongs to them.

    Attributes
    ----------
    inputs, pairs, topics, region, calibration
        See `EstimateOptions`.
    quiet : bool
        Whether no line says what the folders hold beside what is read.
    skip : sequence of str
        The output folders, which are not searched.
    """

    inputs: InputOptions
    quiet: bool
    pairs: PairOptions = PairOptions()
    topics: TopicOptions = TopicOptions()
    region: RegionOptions = RegionOptions()
    calibration: CalibrationOptions = CalibrationOptions()
    skip: Sequence[str] = ()


def map_frames(named: Named) -> Sequence[Frame]:
    """Make a frame of each map.

    Raises
    ------
    UsageError
        Nothing is named or found, a mask or a calibration is missing, or names are not sorted that should be.
    """
    given = named.inputs
    if given.sorted:
        return _sorted_frames(named)
    if not (given.inputs or given.files_from):
        raise UsageError("no input: name maps (files, folders, patterns, or - for a list on stdin)")
    make = _FrameMaker(named)
    if bags := _bags(given):
        from rollcli.files.recordings.frames import maps_of_bag

        found_maps = [maps_of_bag(files, name, given.topic) for name, files in bags]
        return _bag_frames(found_maps, make)[:: given.every]
    if given.topic is not None:
        raise UsageError("--topic is of a bag (.bag, .db3, .mcap or a rosbag2 folder), and none is given")
    with _search(named, MAP_ENDINGS, maps=True) as search:
        found = find_inputs(given.inputs, search, files_from=given.files_from)
    if video := next((each.name for each in found if is_video(each.location)), None):
        raise UsageError(
            f"{video}: is a video, of views and not of maps: give --side-by-side (estimate, disparity) "
            "where its frames hold both, or --left and --right with a video each"
        )
    return [make.frame(each) for each in found[:: given.every]]


@contextlib.contextmanager
def _search(named: Named, endings: tuple[str, ...], *, maps: bool = False) -> Iterator[Search]:
    """Say, once the search is over, what it has noted."""
    given = named.inputs
    search = Search(endings, given.recursive, given.include, given.exclude, named.skip, maps)
    yield search
    _say(search.notes, quiet=named.quiet)


def _say(notes: Iterable[str], *, quiet: bool) -> None:
    for note in () if quiet else dict.fromkeys(notes):
        say(note)


def _sorted_frames(named: Named) -> "SortedFrames":
    given = named.inputs
    if given.inputs or given.files_from is None or given.files_from == "-" or is_url(given.files_from):
        raise UsageError("--sorted takes the names of one file on disk: give --files-from FILE and no input")
    manifest = Manifest(given.files_from)
    places = range(0, len(manifest), given.every)
    return SortedFrames(manifest, _FrameMaker(named), places)


class SortedFrames(Sequence[Frame]):
    """The frames of a manifest, made when they are asked for; a slice of them is another such sequence."""

    def __init__(self, manifest: Manifest, make: "_FrameMaker", places: range) -> None:
        self._manifest, self._make, self._places = manifest, make, places

    def __len__(self) -> int:
        return len(self._places)

    def __iter__(self) -> Iterator[Frame]:
        for name in self._manifest.names(self._places):
            yield self._make.frame(named_input(name))

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> "SortedFrames": ...

    def __getitem__(self, index: int | slice) -> "Frame | SortedFrames":
        if isinstance(index, int):
            return next(iter(self[index : index + 1 or None]))
        return SortedFrames(self._manifest, self._make, self._places[index])


def pair_frames(named: Named) -> list[Frame]:
    """Make a frame of each stereo pair: of two places, of topics of bags, or of images that hold both views.

    Raises
    ------
    UsageError
        Pairs are named in no way, or in several; a side is missing, an image has no partner, or a mask or a
        calibration is missing.
    """
    given, pairs, topics = named.inputs, named.pairs, named.topics
    has_inputs = bool(given.inputs or given.files_from)
    sides, views = (pairs.left, pairs.right), (topics.left_topic, topics.right_topic)
    ways = [any(sides), any(views), pairs.side_by_side is not None]
    if has_inputs and ways == [True, False, False]:
        raise UsageError("give either maps, or pairs by --left and --right")
    if has_inputs and not any(ways):
        raise UsageError(
            f"{' '.join(given.inputs[:2])}: images are given by --left and --right; with --side-by-side, or "
            "--left-topic and --right-topic, INPUTS are images, videos or bags"
        )
    if sum(ways) != 1 or has_inputs is any(sides):
        raise UsageError(
            "name pairs in one way: --left and --right alone; or INPUTS, with --left-topic and --right-topic "
            "for bags, or --side-by-side for images and videos that hold both views"
        )
    make = _FrameMaker(named)
    if any(views):
        return _bag_pairs(named, make)[:: given.every]
    videos = VIDEOS if pairs.side_by_side is not None else ()
    with _search(named, (*IMAGE_ENDINGS, *videos)) as search:
        if pairs.side_by_side is not None:
            found = find_inputs(given.inputs, search, files_from=given.files_from)
            both = [views for each in found for views in _halved(each, pairs.side_by_side)]
        elif pairs.left is None or pairs.right is None:
            raise UsageError("--left and --right are given together")
        else:
            matched = pair_inputs(pairs.left, pairs.right, search, match=pairs.match)
            both = [views for pair in matched for views in _paired(pair)]
    return [make.frame(left, right) for left, right in both[:: given.every]]


def _halved(each: Input, layout: Layout) -> list[tuple[Input, Input]]:
    """List the frames of a video as pairs, and an image as one."""
    if not is_video(each.location):
        return [(each, each)]
    _require_local(each.location)
    from rollcli.files.recordings.video import frames_of_video

    found = frames_of_video(each.location, each.name, each.relative, layout)
    return [(view, view) for view in map(_recorded, found)]


def _paired(pair: Pair) -> list[tuple[Input, Input]]:
    """Pair the frames of two videos; images are a pair themselves."""
    both = pair.left, pair.right
    if not any(is_video(each.location) for each in both):
        return [both]
    for each in both:
        _require_local(each.location)
    from rollcli.files.recordings.video import frames_of_pair

    found = frames_of_pair(*((each.location, each.name, each.relative) for each in both))
    return [(_recorded(one), _recorded(other)) for one, other in found]


def _recorded(frame: "RecordingFrame") -> Input:
    return Input(frame.location, frame.name.replace(os.sep, "/"), frame.relative)


def _require_local(location: str) -> None:
    """Refuse a recording in a store, which can only be read from its start to its end."""
    if is_url(location):
        raise UsageError(f"{public_name(location)}: recordings are read from local disk: download it first")


def _bag_pairs(named: Named, make: "_FrameMaker") -> list[Frame]:
    left, right = named.topics.left_topic, named.topics.right_topic
    if left is None or right is None:
        raise UsageError("--left-topic and --right-topic are given together")
    bags = _bags(named.inputs)
    if not bags:
        raise UsageError(
            "--left-topic and --right-topic are of a bag: name a .bag, .db3, .mcap or rosbag2 folder"
        )
    from rollcli.files.recordings.frames import pairs_of_bag

    tolerance = round(named.topics.sync_tolerance * 1e6)
    found = [pairs_of_bag(files, name, left, right, tolerance) for name, files in bags]
    return _bag_frames(found, make)


def _bags(given: InputOptions) -> list[tuple[str, list[str]]]:
    """List the bags among the inputs, each with its files; all inputs are bags, or none is.

    Raises
    ------
    UsageError
        Some are, or one is in a store, or the extra is missing.
    """
    bags = []
    for name in dict.fromkeys(given.inputs):
        if name.lower().endswith(BAGS):
            _require_local(name)
        if files := [] if is_url(name) else bag_files(name):
            bags.append((name, files))
    if bags and (len(bags) < len(set(given.inputs)) or given.files_from is not None):
        raise UsageError(f"{bags[0][0]}: is a bag: give bags and other inputs in runs of their own")
    if bags:
        require_extra("bags", bags[0][0])
    return bags


def _bag_frames(bags: "Iterable[BagFrames]", make: "_FrameMaker") -> list[Frame]:
    frames = []
    for bag in bags:
        _say(bag.notes, quiet=make.quiet)
        for left, right in bag.frames:
            frame = make.frame(_recorded(left), right and _recorded(right))
            own = make.calibrations.given
            frames.append(frame if own else replace(frame, calibration=bag.calibration))
    return frames


class _FrameMaker:
    """Makes frames, with the masks and calibrations that were named: one for all, or one of each stem."""

    def __init__(self, named: Named) -> None:
        self.calibrations, self.quiet = Calibrations(named.calibration), named.quiet
        self._mask = named.region.mask
        self._masks: dict[str, str] | None = None
        if self._mask is not None and is_place(self._mask):
            found = find_inputs([self._mask], Search(recursive=True))
            self._masks = {Path(frame_name(each.name)).stem: each.location for each in found}
        elif self._mask is not None and not (is_url(self._mask) or is_file(self._mask)):
            raise UsageError(f"{self._mask}: no such mask file or folder")

    def frame(self, left: Input, right: Input | None = None) -> Frame:
        """Make the frame of a map, or of the views of a pair."""
        mask, stem = self._mask, PurePath(frame_name(left.name)).stem
        if self._masks is not None and (mask := self._masks.get(stem)) is None:
            raise UsageError(f"{left.name}: has no mask of its name in {self._mask}")
        # what is made of an input must stay in its folder, whatever a store or an archive calls it
        foreign = is_url(left.location) or file_of(left.location) != left.location
        return Frame(
            file=left.name,
            right_file=right.name if right else "",
            path=left.location,
            right_path=right.location if right else "",
            relative=left.relative if not foreign or names_a_file(left.relative) else "",
            mask=mask,
            calibration=self.calibrations.of(left.name),
        )
