"""Inputs and their names: the natural order of these, and which left image belongs to which right one."""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TypeVar

from rollcli.files.stores.locations import is_url, public_name

Key = TypeVar("Key")
Value = TypeVar("Value")

# the marks of a left and of a right image: a word or letter of its own, leftImg8bit, m1_L1, 000123r, imgL
_WORD = (
    r"(?<![A-Za-z])(?:{0}|{1})(?![a-z])|(?<![A-Z]){2}(?![a-z])"
    r"|(?<![A-Za-z])[{3}{4}](?:cam)?(?![A-Za-z])|(?<=[a-z]){4}(?![A-Za-z])"
)
_WORDS = [
    _WORD.format(side, side.upper(), side.title(), side[0], side[0].upper()) for side in ("left", "right")
]
# numbers count as marks after such a word, else at the end of a name: im0, image_02, cam1/000.png, 000123_0
_NEVER = "(?!)"
_NUMBERS = ((_NEVER, _NEVER), ("0", "1"), ("2", "3"), ("1", "2"), ("1", "5"), ("2", "6"), ("5", "6"))
_AFTER_WORD = r"((?<![A-Za-z])(?:im|img|image|cam|camera|view|infra)[_-]?)0*{}(?![0-9])"
_AT_END = r"((?<=[A-Za-z0-9])[_-])0*{}$"
_POSITION = re.compile(r"#@([0-9]+(?:\+[0-9]+)+)$")


@dataclass(frozen=True, slots=True)
class Input:
    """A file, or a frame inside of one, to work on.

    Attributes
    ----------
    location : str
        Where it is.
    relative : str
        Its path below the folder or pattern it was found in: where outputs keep it.
    stamp : int
        When a frame of a bag was taken, ns; 0 of others.
    """

    location: str
    relative: str
    stamp: int = 0

    @property
    def name(self) -> str:
        """As the user named it, with "/" separators: what a result's column `file` says."""
        if is_url(self.location):
            return public_name(self.location)
        return split_position(self.location)[0].replace(os.sep, "/")


def split_position(location: str) -> tuple[str, tuple[int, ...]]:
    """Split off where a frame lies in its file, in whole numbers; none where the location does not say."""
    found = _POSITION.search(location) if "#@" in location else None
    if found is None:
        return location, ()
    return location[: found.start()], tuple(map(int, found[1].split("+")))


def natural_key(name: str) -> str:
    """Make a sort key that puts frame2 before frame10, folder by folder.

    A string, since a batch has a hundred thousand of them: a folder ends with the lowest character, numbers
    come before text, and a number is told by its length first.
    """
    folder, slash, base = name.rpartition("/")
    return f"{_folder_key(folder)}\0{_part_key(base)}" if slash else _part_key(base)


@lru_cache(maxsize=1024)  # a folder holds many names
def _folder_key(folder: str) -> str:
    return "\0".join(map(_part_key, folder.split("/")))


def _part_key(part: str) -> str:
    return "".join(map(_run_key, _RUNS.findall(part)))


_RUNS = re.compile(r"[0-9]+|[^0-9]+")
_NUMBER, _TEXT, _MOST_DIGITS = "\1", "\2", 50_000


def _run_key(run: str) -> str:
    if "0" <= run[0] <= "9":
        digits = run.lstrip("0")  # not int(): Python refuses numbers of thousands of digits
        return f"{_NUMBER}{chr(min(len(digits), _MOST_DIGITS) + 3)}{digits}{run}"
    return _TEXT + run


# pairs of left and right names; and those that share one key, when they are more than two. All numbers are
# positions in the given lists
Matching = tuple[list[tuple[int, int]], tuple[list[int], list[int]] | None]


def match_names(lefts: Sequence[str], rights: Sequence[str], *, marked: bool = False) -> Matching:
    """Match names that are equal but for their endings; where none are, by their left and right marks.

    Parameters
    ----------
    lefts, rights : sequence of str
        Relative paths with "/" separators; marks in folder names count too (image_2/0.png, image_3/0.png).
    marked : bool
        Only marks count: both sides hold the same files, and each is a left or a right one.

    Notes
    -----
    One rule serves all names: were equal names and marks mixed, a frame_0 without a partner could pair with
    the frame_1 of another moment.
    """
    if not marked:
        equal = _matching(map(_stem, lefts), map(_stem, rights))
        if equal[0]:
            return equal
    left, right = (
        [re.sub(word, "*", _stem(each)) for each in names]
        for word, names in zip(_WORDS, (lefts, rights), strict=True)
    )
    best: Matching = [], None
    for last, (left_mark, right_mark) in (*product((False,), _NUMBERS), *product((True,), _NUMBERS[1:])):
        found = _matching(_keys(left, left_mark, marked, last), _keys(right, right_mark, marked, last))
        best = max(best, found, key=lambda each: len(each[0]))
        if len(best[0]) == len(lefts):
            break
    return best


def _matching(*keys_of: Iterable[str | None]) -> Matching:
    left_of, right_of = (
        gathered((key, place) for place, key in enumerate(keys) if key is not None) for keys in keys_of
    )
    both = [(left_of[key], right_of[key]) for key in left_of if key in right_of]
    pairs = [(lefts[0], rights[0]) for lefts, rights in both]
    return pairs, next((sides for sides in both if sum(map(len, sides)) > 2), None)


def gathered(pairs: Iterable[tuple[Key, Value]]) -> dict[Key, list[Value]]:
    """Gather what has the same key, in the order it comes in."""
    groups: dict[Key, list[Value]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def _stem(relative: str) -> str:
    folder, slash, name = relative.rpartition("/")
    return folder + slash + (name.rpartition(".")[0] or name)


def _keys(names: Iterable[str], number: str, marked: bool, last: bool) -> Iterator[str | None]:
    """Cut off numbers that are marks, with `last` those at ends too; None if `marked` and there is none."""
    after_word, at_end = (re.compile(each.format(number)) for each in (_AFTER_WORD, _AT_END))
    for name in names:
        if last:  # im1_0001: 0001 is the frame's
            parts = (after_word.subn(r"\1*", part) for part in name.split("/"))
            key = "/".join(part if found else at_end.sub(r"\1*", part) for part, found in parts)
        else:
            key = after_word.sub(r"\1*", name)
        yield None if marked and "*" not in key else key
