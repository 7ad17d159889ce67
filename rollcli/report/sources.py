"""Where the pictures of a frame come from, and which frames the gallery shows."""

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from rollcli.errors import UsageError
from rollcli.files.atomic import is_file, is_folder
from rollcli.files.containers import frame_name
from rollcli.files.results import Result, Row, run_path
from rollcli.files.search import MAP_ENDINGS, objects_behind
from rollcli.files.stores.locations import base_name, is_remote, is_url, store_of
from rollcli.messages import listed
from rollcli.run.frame import Frame, frame_of_row
from rollcli.run.options import KINDS, FramesOptions, ImageKind, ImageOptions
from rollcli.run.resume import recorded_calibrations, recorded_options
from rollcli.simulate.options import TRUTH

JUMP, WIDEST, SUSPECT, SPREAD = "around a jump", "widest interval", "suspect", "evenly spread"


def choose(rows: Sequence[Row], count: int, jumps: Sequence[int] = ()) -> dict[int, str]:
    """Choose up to `count` frames that have an angle: those around jumps, and a third each of other kinds.

    Parameters
    ----------
    rows : sequence of Row
    count : int
    jumps : sequence of int
        The places of the first frames after a jump.

    Returns
    -------
    dict of int to str
        Places among the rows, and why they are chosen.
        The last frame before each jump and the first after it, for up to half of `count`, the latest jumps;
        the widest intervals, from the widest on; then suspect frames and others, in their order.
    """
    angled = [place for place, row in enumerate(rows) if row.roll_deg is not None]
    around = dict[int, None]()
    for jump in sorted(jumps)[::-1][: count // 4]:
        at = bisect.bisect_left(angled, jump)
        around |= dict.fromkeys(angled[max(at - 1, 0) : at + 1])
    chosen = dict.fromkeys(sorted(around), JUMP)
    share = (count - len(chosen)) // 3

    def left() -> list[int]:
        return [place for place in angled if place not in chosen]

    widths = [(-(rows[place].roll_ci95_deg or 0.0), place) for place in left()]
    chosen |= {place: WIDEST for width, place in sorted(widths)[:share] if width < 0}
    doubtful = [place for place in left() if rows[place].status == "suspect"]
    chosen |= dict.fromkeys(spread(doubtful, share), SUSPECT)
    return chosen | dict.fromkeys(spread(left(), count - len(chosen)), SPREAD)


def spread(places: Sequence[int], count: int) -> list[int]:
    """Up to `count` of the places, evenly spread, each in the middle of its stretch."""
    if count >= len(places):
        return list(places)
    return [places[(2 * i + 1) * len(places) // (2 * count)] for i in range(count)]


@dataclass(frozen=True, slots=True)
class Subject:
    """A frame to take pictures of.

    Attributes
    ----------
    frame : Frame
        Where its map or its pair is.
    images : dict of str to str
        The files that `estimate` wrote for it, by kind.
    row : Row
        What the result says of it.
    options : FramesOptions
        How its result was made.
    refused : str
        Why the inputs are not read; empty where they may be.
    """

    frame: Frame
    images: dict[str, str]
    row: Row
    options: FramesOptions
    refused: str = ""

    @property
    def theta(self) -> float:
        """What its map is turned by, radians."""
        return math.radians(self.row.map_roll_deg or 0.0)


def subjects(
    chosen: Sequence[tuple[int, Row]], parts: Sequence[Result], images: str | None, *, fetch: bool
) -> list[Subject]:
    """Find the files of rows of results that have an angle.

    Parameters
    ----------
    chosen : sequence of (int, Row)
        Each row, and which of the results it is of.
    parts : sequence of Result
        Their paths: names that do not exist from here are looked for beside them. And their runs: how they
        were made, which folders they wrote images to, and their calibration, where all rows have one.
    images : str or None
        The folder of images, or of folders of images, that `estimate` wrote.
    fetch : bool
        Whether inputs are asked for in whichever store a row names: a result from elsewhere may name a
        service of this network, or a bucket that the user's keys open. By default only in the result's own.

    Raises
    ------
    UsageError
        There is no such folder, or there are no images of some rows in it.
    InputError
        The record of a run is none.
    """
    there = None if images is None else _ImageFolder(images)
    runs = [
        (recorded_options(part.run, run_path(part.path)), recorded_calibrations(part.run)) for part in parts
    ]
    found = []
    for owner, row in chosen:
        result, (options, calibrations) = parts[owner].path, runs[owner]
        calibration = calibrations[0] if len(calibrations) == 1 else None  # else each frame has its own
        frame = frame_of_row(row, result)._replace(calibration=calibration)
        files = {} if there is None else _images(row, there, options.images)
        found.append(Subject(frame, files, row, options, _refusal(row, result, there, fetch)))
    if there is not None and (without := [each.row.file for each in found if not each.images]):
        raise UsageError(
            f"{images}: has no image of {listed(without)}: name the folder where estimate has put what it "
            "wrote, or leave --images out to have the pictures made from the inputs"
        )
    return found


def _refusal(row: Row, result: str, images: "_ImageFolder | None", fetch: bool) -> str:
    """Say why a row's inputs are not read; empty where they are local or lie in the result's store.

    Where there are images, pictures come from these alone: a result from elsewhere may name any file.
    """
    if images is not None:
        return f"{row.file}: there is no map of it among the images"
    for name in filter(None, (row.file, row.right_file)):
        followed = fetch or (is_url(name) and is_url(result) and store_of(name) == store_of(result))
        if is_remote(name) and not followed:
            return f"{name}: is remote, and the result does not lie there; --fetch follows it"
    return ""


class _ImageFolder:
    """A folder of images, or of folders of images, on disk or in an object store.

    Raises
    ------
    UsageError
        There is none.
    """

    def __init__(self, location: str) -> None:
        self._location = location.rstrip("/")
        self._objects: frozenset[str] | None = None
        if is_url(location):
            self._objects = frozenset(url for url, _ in objects_behind(location, recursive=True))
        if not (is_folder(location) if self._objects is None else self._objects):
            raise UsageError(f"{location}: no such folder of images")

    def find(self, relative: str) -> str | None:
        """Return where a file below it lies; neither a name nor a link leads out of it."""
        location = f"{self._location}/{relative}"
        if self._objects is not None:
            return location if location in self._objects else None
        path, inside = Path(location), Path(self._location).resolve()
        return location if is_file(path) and path.resolve().is_relative_to(inside) else None

    @property
    def name(self) -> str:
        """Its own name, without the folders above."""
        return Path(self._location).resolve().name

    def is_recorded(self, recorded: str | None, below: str = "") -> bool:
        """Tell whether this folder, or one below it, is the one that the run wrote to."""
        return recorded is not None and Path(self._location, below).resolve() == Path(recorded).resolve()


def _images(row: Row, images: _ImageFolder, recorded: ImageOptions) -> dict[str, str]:
    return {kind.name: path for kind in KINDS if (path := _image(kind, row, images, recorded))}


def _image(kind: ImageKind, row: Row, images: _ImageFolder, recorded: ImageOptions) -> str | None:
    folders, names = _folders(kind.name, images, recorded), [*_tails(row.file)]
    endings = (".png",) if kind.holds == "picture" else MAP_ENDINGS
    places = (f"{folder}{name}{ending}" for folder in folders for name in names for ending in endings)
    return next(filter(None, map(images.find, places)), None)


_TRUE = ("disparity", "heights")  # beside the truth of a simulation they are not those of a run


def _folders(kind: str, images: _ImageFolder, recorded: ImageOptions) -> Iterator[str]:
    """Yield where images of a kind may be: in the folder named, under the name it had or the option's.

    Where the run wrote images of another kind to a folder of that name, only its own folder is this kind's.
    """
    places = {each.name: place.rstrip("/") for each in KINDS if (place := getattr(recorded, each.name))}
    mine = places.get(kind)
    others = {base_name(place) for place in places.values() if place != mine}
    given = [] if mine is None else [base_name(mine)]
    usual = [] if kind in _TRUE and images.find(TRUTH) is not None else [kind]
    names = [name for name in dict.fromkeys([*given, *usual]) if name != ".."]
    for name in names:
        if name not in others or images.is_recorded(mine, name):
            yield f"{name}/"
    if images.is_recorded(mine) or (images.name in names and images.name not in others):
        yield ""


def _tails(file: str) -> Iterator[str]:
    """Yield the path without its ending, then without its first folder, and so on."""
    inside = frame_name(file)
    holder = file.removesuffix(inside).removesuffix("#")
    # an archive is a folder; a recording lies in one
    path = PurePosixPath(file).parent / inside if holder == file else PurePosixPath(holder, inside)
    parts = path.with_suffix("").parts if path.name else ()  # "/" and "." name no file
    for first in range(1 if path.is_absolute() else 0, len(parts)):
        if ".." not in parts[first:]:  # which would lead out of the folder of images
            yield "/".join(parts[first:])
