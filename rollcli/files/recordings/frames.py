"""The frames of a bag: which topics fit, what belongs together, and one frame by its place."""

import contextlib
import os
import re
import sys
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rollcli.errors import InputError, UsageError, about, as_usage
from rollcli.files.bounded import state_of
from rollcli.files.naming import Input, split_position
from rollcli.files.recordings import messages
from rollcli.files.recordings.bags import Topic, opened
from rollcli.files.recordings.messages import CAMERA_INFO, COMPRESSED, DISPARITY, IMAGE, CameraInfo
from rollcli.messages import counted, listed
from rollcli.rig.calibration import Calibration

_RAW = re.compile("image_(raw|mono|color)")  # what image_proc rectifies [http://wiki.ros.org/image_proc]
_NO_P = "no CameraInfo with a principal point (P) in the image: no pitch and no height without --calib"
_NO_LEFT = "no CameraInfo of the left view, but with a negative Tx: no pitch and no height without --calib"


@dataclass
class BagFrames:
    """What a bag, of one file or several, has for a run.

    Attributes
    ----------
    frames : list of (Input, Input or None)
        Maps, or left and right views.
    calibration : Calibration or None
        Of the rectified pair, by CameraInfo.
    notes : list of str
        What the user should know, a line each.
    uncalibrated : list of str
        What a user should know who gives no calibration.
    """

    frames: list[tuple[Input, Input | None]] = field(default_factory=list)
    calibration: Calibration | None = None
    notes: list[str] = field(default_factory=list)
    uncalibrated: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Found:
    """The frames of some topics, the CameraInfo of cameras and their places, and what is broken.

    `changes`: of cameras whose later CameraInfo is another one, the stamp of the first of these.
    """

    frames: dict[str, list[Input]]
    cameras: dict[str, CameraInfo]
    changes: dict[str, int]
    places: dict[tuple[str, str], str]
    broken: list[Input]


Bags = list[tuple[str, list[str]]]  # each by its name, with its files


def readable_bags(bags: Bags) -> tuple[Bags, list[Input]]:
    """Leave out the files that cannot be opened, such as one that was begun as the power failed.

    Returns
    -------
    list of (str, list of str)
        The bags that have other files, with these.
    list of Input
        Of each file left out a frame, which fails and says why.

    Raises
    ------
    UsageError
        No file can be opened.
    """
    faults: dict[str, InputError] = {}
    for path in (each for _, files in bags for each in files):
        try:
            opened(path)
        except InputError as error:
            faults[path] = error
    kept = ((name, [each for each in files if each not in faults]) for name, files in bags)
    readable = [each for each in kept if each[1]]
    if not readable:
        raise UsageError(str(next(iter(faults.values()))))
    return readable, [_rest(path) for path in faults]


def _rest(path: str) -> Input:
    """Return the frame that stands for what is broken in a file: it fails and says why."""
    return Input(f"{path}#rest", f"{Path(path).stem}_rest.npy")


def frames_of_bag(
    files: Sequence[str], name: str, topic: str | None, left: str | None, right: str | None, tolerance: float
) -> BagFrames:
    """Find the maps of a bag, or pair the views of two topics.

    Parameters
    ----------
    files : sequence of str
        Its files, in their order.
    name : str
        What errors call it.
    topic : str or None
        That of maps; None: the only one that fits.
    left, right : str or None
        Those of views, in place of maps.
    tolerance : float
        By how many ms the header stamps of a pair may differ.

    Raises
    ------
    UsageError
        There is no such topic, none or several that fit, nothing in them, or no pair.
    """
    topics = _topics(files)
    views = () if left is None or right is None else (left, right)
    chosen = views or (topic or _only_map_topic(files, topics, name),)
    found = _scan(files, [_known(topics, each, name) for each in chosen], topics)
    bag = BagFrames()
    if views:
        _add_pairs(bag, found, files, name, *views, round(tolerance * 1e6))
    else:
        _add_maps(bag, found, topics[chosen[0]], name)
    if not bag.frames and not found.broken:
        empty = (each for each in chosen if not found.frames[each])
        raise UsageError(f"{name}: has no messages of {' and '.join(empty)}")
    bag.frames += [(rest, rest if views else None) for rest in found.broken]
    return bag


def _add_maps(bag: BagFrames, found: _Found, topic: Topic, name: str) -> None:
    """Add the disparity or depth maps of a topic, and the calibration of its cameras."""
    frames, has_doffs = found.frames[topic.name], topic.type == DISPARITY
    bag.frames = [(each, None) for each in frames]
    left, right = _cameras(found, topic.name)
    stated = 0.0
    for each in frames if has_doffs else ():
        with contextlib.suppress(InputError):  # a damaged one says so in its row
            data = opened(each.location.partition("#")[0]).read(split_position(each.location)[1])
            stated = messages.baseline_of(topic, data)
            break
    if stated < 0 and right is None:
        bag.notes.append(f"{name}: {topic.name} states a baseline T of {stated:g} m: taken as {-stated:g} m")
    _calibrate(bag, found, left, right, abs(stated), name)
    if bag.calibration is None and (found.cameras or has_doffs):
        lacks = _NO_LEFT if any(each.usable for each in found.cameras.values()) else _NO_P
        bag.uncalibrated.append(f"{name}: {lacks}")
    elif bag.calibration is not None and has_doffs:
        bag.calibration = replace(bag.calibration, doffs=0.0)


def _add_pairs(
    bag: BagFrames, found: _Found, files: Sequence[str], name: str, left: str, right: str, tolerance_ns: int
) -> None:
    """Pair the views of two topics by their header stamps, each with the nearest one within a tolerance."""
    for topic in (left, right):
        info, is_raw = found.cameras.get(_beside(topic)), _RAW.search(topic)
        if is_raw and info is not None and info.changes_raw_views:
            bag.notes.append(f"{topic}: raw views are rectified by D, K, R and P of {_beside(topic)}")
            found.frames[topic] = [_rectified(found, topic, each) for each in found.frames[topic]]
            bag.notes += [
                f"{path}: has no {_beside(topic)}: its raw views are taken as they are"
                for path in files
                if (path, _beside(topic)) not in found.places
            ]
        elif is_raw and not (info is not None and info.usable):
            bag.notes.append(f"{topic}: raw views are taken as they are: no CameraInfo with P rectifies them")
    lefts, rights = found.frames[left], found.frames[right]
    stamps = [each.stamp for each in lefts], [each.stamp for each in rights]
    pairs = nearest(*stamps, tolerance_ns)
    bag.frames = [(lefts[one], rights[other]) for one, other in pairs.items()]
    within = f"within {tolerance_ns / 1e6:g} ms"
    if not pairs and lefts and rights:
        with as_usage():  # what is compressed by itself has no stamps
            path, _, member = split_position(lefts[0].location)[0].rpartition("#")
            read_frame(path, member, lefts[0].name)
        some = nearest(*stamps, sys.maxsize).items()
        apart = min(abs(stamps[0][one] - stamps[1][other]) for one, other in some) / 1e6
        far = f"no views of {left} and {right} are {within}, the nearest are {apart:g} ms apart"
        raise UsageError(f"{name}: {far}: --sync-tolerance")
    for side, views, paired in (("left", lefts, {*pairs}), ("right", rights, {*pairs.values()})):
        if alone := [f"@{each.stamp}" for at, each in enumerate(views) if at not in paired]:
            without = f"{counted(len(alone), f'{side} view')} without a partner {within}"
            bag.notes.append(f"{name}: {without}, left out: {listed(alone)}")
    one, other = (found.cameras.get(_beside(each)) for each in (left, right))
    _calibrate(bag, found, one, other, 0.0, name)
    if bag.calibration is None and found.cameras:
        bag.uncalibrated.append(f"{name}: {_beside(left)} is {_NO_P}")


def is_disparity_image(path: str, member: str) -> bool:
    """Tell whether a frame is one; its disparities are x_l - x_r - (cx_l - cx_r) already."""
    with contextlib.suppress(InputError, KeyError):  # its row says so
        return opened(path).topics[split_position(member)[0].rpartition("@")[0]].type == DISPARITY
    return False


def nearest(lefts: Sequence[int], rights: Sequence[int], tolerance: int) -> dict[int, int]:
    """Find the left and right stamps, each in ascending order, that are each other's nearest.

    Returns
    -------
    dict of int to int
        By the position of each left stamp that of the right one, if there is one within the tolerance.
    """

    def closest(stamp: int, stamps: Sequence[int]) -> int | None:
        at = bisect_left(stamps, stamp)
        off = {each: abs(stamps[each] - stamp) for each in range(max(at - 1, 0), min(at + 1, len(stamps)))}
        return min((each for each in off if off[each] <= tolerance), key=off.__getitem__, default=None)

    pairs = dict[int, int]()
    for place, stamp in enumerate(lefts):
        right = closest(stamp, rights)
        if right is not None and closest(rights[right], lefts) == place:
            pairs[place] = right
    return pairs


def read_frame(path: str, member: str, name: str) -> bytes | NDArray[Any]:
    """Read one frame of a bag; see `messages.content_of`.

    Parameters
    ----------
    path : str
        The bag's file.
    member : str
        The topic and the stamp, ``/stereo/disparity@1700000000123456789``, and behind these its place: two
        numbers; two more of the CameraInfo by which a raw view is rectified; none: it is searched. Or
        ``rest``, which is an error.
    name : str
        What errors call it.
    """
    bag = opened(path)
    if member == "rest":
        list(bag.messages(set()))
        raise InputError(f"{name}: {bag.broken or 'is whole'}; its whole messages are used")
    member, place = split_position(member)
    topic_name, _, stamp = member.rpartition("@")
    topic = bag.topics.get(topic_name)
    if topic is None:
        raise InputError(f"{name}: no such topic in {path}")
    searched = not place
    if searched:
        place = _index(*state_of(path), topic_name).get(stamp, ())
    if not place:
        raise InputError(f"{name}: no such frame in {path}")
    data, raw_of = bag.read(place[:2]), None
    info = bag.read(place[2:]) if len(place) == 4 else None
    with about(name):
        # depth maps, too, may be called image_raw
        if info is not None and not (searched and messages.is_map(topic, data)):
            raw_of = messages.camera_info(Topic(_beside(topic_name), CAMERA_INFO, topic.encoding), info)
        return messages.content_of(topic, data, raw_of)


@lru_cache(maxsize=2)  # for names without a place, such as those of a result that is drawn
def _index(path: str, size: int, modified_ns: int, process: int, topic: str) -> dict[str, tuple[int, ...]]:
    topics = _topics([path])
    found = _scan([path], [topics[topic]], topics)
    frames, info = found.frames[topic], found.cameras.get(_beside(topic))
    if _RAW.search(topic) and info is not None and info.changes_raw_views:
        frames = [_rectified(found, topic, each) for each in frames]
    return {each.name.rpartition("@")[2]: split_position(each.location)[1] for each in frames}


def _topics(files: Iterable[str]) -> dict[str, Topic]:
    topics: dict[str, Topic] = {}
    for path in files:
        with as_usage():
            topics |= opened(path).topics
    return topics


def _known(topics: dict[str, Topic], topic: str, name: str) -> Topic:
    if topic not in topics:
        raise UsageError(f"{name}: has no topic {topic}; {_all(topics)}")
    with as_usage(), about(name):
        messages.check_decoder(topics[topic])
    return topics[topic]


def _decodable(topics: dict[str, Topic], kind: str) -> list[Topic]:
    return [each for each in topics.values() if each.type == kind and each.encoding in ("cdr", "ros1")]


def _all(topics: dict[str, Topic]) -> str:
    some = sorted(f"{each.name} ({each.type})" for each in topics.values())
    return f"its topics: {listed(some, most=20) or 'none'}"


def _only_map_topic(files: Sequence[str], topics: dict[str, Topic], name: str) -> str:
    """Return the only topic of maps."""
    fitting = [each.name for each in topics.values() if each.type == DISPARITY]
    fitting += _of_maps(files, topics, IMAGE)
    fitting = fitting or _of_maps(files, topics, COMPRESSED)  # which often repeat those
    if len(fitting) == 1:
        return fitting[0]
    options = " or ".join(f"--topic {each}" for each in sorted(fitting))
    if fitting:
        raise UsageError(f"{name}: several topics fit: give one of {options}")
    views = any(each.type in (IMAGE, COMPRESSED) for each in topics.values())
    hint = "; for views give --left-topic and --right-topic" if views else ""
    raise UsageError(f"{name}: has no topic of disparity or depth maps{hint}; {_all(topics)}")


def _of_maps(files: Sequence[str], topics: dict[str, Topic], kind: str) -> list[str]:
    """Return the topics of images of a kind whose first whole one can be a map by its pixels."""
    images = {each.name for each in _decodable(topics, kind)}
    found: dict[str, str] = {}
    for message in (each for path in files if images for each in opened(path).messages(images)):
        if message.topic not in found:
            with contextlib.suppress(InputError):  # the next one may be whole
                found[message.topic] = messages.image_encoding(topics[message.topic], message.data)
        if len(found) == len(images):
            break
    return [each for each, pixels in found.items() if pixels in messages.MAP_ENCODINGS]


def _scan(files: Sequence[str], wanted: Sequence[Topic], topics: dict[str, Topic]) -> _Found:
    """Read through the files once: the stamps of the wanted topics, and a CameraInfo of each camera."""
    by_name = {each.name: each for each in wanted}
    infos = {each.name for each in _decodable(topics, CAMERA_INFO)}
    frames: dict[str, list[Input]] = {each: [] for each in by_name}
    cameras: dict[str, CameraInfo] = {}
    firsts: dict[str, memoryview] = {}
    changes: dict[str, int] = {}
    places: dict[tuple[str, str], str] = {}
    broken = []
    seen: dict[str, int] = {}
    endings: dict[str, str] = {}
    for path in files:
        bag = opened(path)
        stem = Path(path).stem
        for message in bag.messages({*by_name, *infos}, by_name):
            place = "{}+{}".format(*message.place)
            if (topic := by_name.get(message.topic)) is None:
                camera, content = message.topic, message.data[12:]  # behind the stamp
                if (path, camera) in places and (content == firsts[camera] or camera in changes):
                    continue
                with contextlib.suppress(InputError):  # the next one says the same
                    info = messages.camera_info(topics[camera], message.data)
                    if info.has_p:  # a driver may write zeros until its calibration is loaded
                        places.setdefault((path, camera), place)
                        firsts.setdefault(camera, content)
                    if not (camera in cameras and cameras[camera].has_p):
                        cameras[camera] = info
                    elif info.has_p and info != cameras[camera]:
                        stamp = messages.stamp_of(topics[camera], message.data, message.log_time)
                        changes.setdefault(camera, stamp)
                continue
            stamp = messages.stamp_of(topic, message.data, message.log_time)
            name = f"{path}#{topic.name}@{stamp}"
            seen[name] = seen.get(name, -1) + 1
            again = f".{seen[name]}" if seen[name] else ""  # a recorder may write a message twice
            if topic.name not in endings:
                with contextlib.suppress(InputError):  # a damaged one says so in its row
                    endings[topic.name] = messages.ending_of(topic, bag.read(message.place))
            ending = endings.get(topic.name, ".npy")
            relative = f"{stem}_{stamp}{again.replace('.', '_')}{ending}"
            frames[topic.name].append(Input(f"{name}{again}#@{place}", relative, stamp))
        if bag.broken:
            broken.append(_rest(path))
    for each in frames.values():  # a recorder writes messages as they come in
        each.sort(key=attrgetter("stamp"))
    return _Found(frames, cameras, changes, places, broken)


def _beside(topic: str) -> str:
    """Name the CameraInfo of an image topic: it lies in the same namespace.

    A compressed image is named below the image that it is of [http://wiki.ros.org/image_transport].
    """
    return f"{topic.removesuffix('/compressed').rpartition('/')[0]}/camera_info"


def _cameras(found: _Found, topic: str) -> tuple[CameraInfo | None, CameraInfo | None]:
    """Return the left and the right camera: the nearest by namespace, then those that are called so."""
    usable = [(name, info) for name, info in found.cameras.items() if info.usable]

    def nearest(side: str, fitting: list[tuple[str, CameraInfo]]) -> CameraInfo | None:
        def nearness(camera: tuple[str, CameraInfo]) -> tuple[int, bool, float, str]:
            name, info = camera
            shared = os.path.commonprefix([name.split("/"), topic.split("/")])  # noqa: RUF071 (of parts)
            return len(shared), side in name, info.across, name

        return max(fitting, key=nearness)[1] if fitting else None

    # the origin of P is the left camera, the right one or one between them
    left = nearest("left", [each for each in usable if each[1].across >= 0])
    fitting = [each for each in usable if left is None or each[1].across < left.across]
    right = nearest("right", fitting or [each for each in usable if "right" in each[0]])  # of a wrong sign
    return left, right


def _calibrate(
    bag: BagFrames,
    found: _Found,
    left: CameraInfo | None,
    right: CameraInfo | None,
    baseline: float,
    name: str,
) -> None:
    """Make the calibration of the rectified pair; none where the left camera's P is not known."""
    bag.notes += [
        f"{name}: {camera} changes at @{stamp}: only what it says before is used, for all frames"
        for camera, stamp in found.changes.items()
        if any(found.cameras[camera] is each for each in (left, right))
    ]
    if left is None or not left.usable:
        return
    p, doffs = left.p, 0.0
    if right is not None and right.usable and right.across != left.across:
        baseline = abs(left.across - right.across)
        # of maps that are aligned to another camera, as depths to that of colours, it would be by chance
        doffs = right.p[2] - p[2] if right.pairs_with(left) else 0.0
        if right.across > left.across:
            bag.notes.append(f"{name}: the right view's Tx is positive, against ROS: its size is taken")
    size, source = (left.width or None, left.height or None), f"CameraInfo of {name}"
    bag.calibration = Calibration(p[0], p[5], p[2], p[6], baseline or None, doffs, *size, source=source)


def _rectified(found: _Found, topic: str, frame: Input) -> Input:
    """Add to a frame's location where its CameraInfo is; a file of a split bag without one stays as it is."""
    place = found.places.get((frame.location.partition("#")[0], _beside(topic)))
    return frame if place is None else replace(frame, location=f"{frame.location}+{place}")
