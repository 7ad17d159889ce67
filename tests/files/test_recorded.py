"""What readers and writers make of small inputs, recorded; see `tests.recorded`."""

import io
import math
import os
import tarfile
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from rollcli.errors import RollcliError
from rollcli.files import bounded, containers, encodings, locking, naming
from rollcli.files.codecs import pictures
from rollcli.files.formats import decode_image, decode_mask, decode_stored, encode_stored
from rollcli.files.inputs import find_inputs, is_elsewhere, match_paths, pair_inputs
from rollcli.files.results import (
    FURTHER,
    Row,
    column_types,
    format_header,
    format_row,
    parse_rows,
    part_names,
    read_columns,
)
from rollcli.files.search import IMAGE_ENDINGS, Search
from rollcli.files.stores import locations
from rollcli.messages import listed
from rollcli.rig.calibration import Calibration
from tests.binary_files import disparity_map, npy_header, tiff_by_tifffile
from tests.files.recordings import small_bags
from tests.files.stores import answers
from tests.fuzz.corpus import corpus
from tests.recorded import check
from tests.run_cli import folder_of

INPUTS = Path(__file__).with_name("inputs.txt").read_text("utf-8").partition("\n\n")[2]
FILES = {name: data for name, data in corpus().items() if name != "large.png"}


def _answer(function, *arguments, **options):
    """What a function returns, or the line of its error."""
    try:
        found = function(*arguments, **options)
        return list(found) if isinstance(found, Iterator) else found
    except RollcliError as error:
        return f"{type(error).__name__}: {error}"


def _map(data):
    found = _answer(decode_stored, data, "x")
    if isinstance(found, str):
        return found
    numbers = [str(found.values.dtype), found.values.astype(float)]
    return [found.format, *numbers, found.nodata, found.note, found.text]


def _cut(data):
    return [_answer(decode, data, "x") for decode in (lambda *given: _map(given[0]), decode_image)]


def _result(data):
    rows = _answer(lambda: list(parse_rows(data, "x")))
    if isinstance(rows, str):
        return rows
    shown = [
        {name: value for name in row.__slots__ if (value := getattr(row, name)) is not None} for row in rows
    ]
    return [shown, [format_row(row, form).decode() for form in ("csv", "jsonl") for row in rows]]


KINDS_OF_URLS = (locations.is_url, locations.is_object_url, locations.is_web_url, locations.is_remote)

OF_MEMBERS = (containers.split_member, containers.frame_name, containers.is_archive)


def _url(name):
    return {
        "kinds": [_answer(function, name) for function in KINDS_OF_URLS],
        "names a file": locations.names_a_file(name),
        "shown": locations.public_name(name),
        "parts": _answer(lambda: locations.is_object_url(name) and locations.split_url(name)),
        "last": _answer(locations.base_name, name),
        "below": _answer(locations.located, "s3://bucket/", name),
        "container": [function(name) for function in OF_MEMBERS],
    }


def _asked(words):
    """The inputs among the words, and what is asked for by name: `recursive`, `include=PATTERN`, ..."""
    named = [word.partition("=") for word in words if word == "recursive" or "=" in word]
    options = {
        name: [value] if name in ("include", "exclude", "skip") else value or True for name, _, value in named
    }
    return [word for word in words if word != "recursive" and "=" not in word], options


def _found(files, words):
    inputs, options = _asked(words)
    files_from = options.pop("files_from", None)
    with folder_of(files), patch("sys.stdin", io.TextIOWrapper(io.BytesIO())):
        found = _answer(lambda: find_inputs(inputs, Search(**options), files_from=files_from))
    return found if isinstance(found, str) else [[each.name, each.relative] for each in found]


def _paired(files, words):
    sides, options = _asked(words)
    with folder_of(files):
        match = options.pop("match", "name")
        found = _answer(lambda: pair_inputs(*sides, Search(IMAGE_ENDINGS, **options), match=match))
    return found if isinstance(found, str) else [[left.name, right.name] for left, right in found]


def _columns(data):
    """What the columns of a result hold that numbers are asked of."""
    with folder_of([]):
        Path("x").write_bytes(data)
        found = _answer(read_columns, "x", ["roll_deg", "height_m"])
    if isinstance(found, str):
        return found
    numbers = {name: np.array(column) for name, column in found.numbers.items()}
    return [found.files, np.array(found.status), numbers, sorted(found.methods)]


def _matched(lefts, rights):
    found = naming.match_names(lefts, rights), naming.match_names(lefts, rights, marked=True)
    return [list(each) for each in found]


READ = {
    "columns": _columns,
    "elsewhere": lambda one, other: [is_elsewhere(one[0], other[0], of_pair=pair) for pair in (False, True)],
    "found": _found,
    "image": lambda data: [_answer(decode, data, "x") for decode in (decode_image, decode_mask)],
    "map": _map,
    "match": lambda names, rows: _answer(match_paths, names, rows, "rolls.csv"),
    "npy": lambda header: _map(npy_header(header.decode("latin-1")) + bytes(100)),
    "order": lambda names: sorted(names, key=naming.natural_key),
    "paired": _paired,
    "pairs": _matched,
    "parts": part_names,
    "result": _result,
    "text": lambda data: _answer(lambda: bounded.as_utf8(data, "x").decode("latin-1")),
    "url": lambda name: _url(name.decode()),
}
OF_NAMES = ("elsewhere", "found", "match", "order", "paired", "pairs", "parts")


def _read(line):
    kind, _, text = line.partition(" ")
    if kind in OF_NAMES:
        return READ[kind](*(part.split() for part in text.split("|")))
    return READ[kind](text.encode().decode("unicode_escape").encode("latin-1"))


SMALL_AND_LARGE = (0.001, 0.5, 1.25, 2.5019, 90, 65534 / 256, 65535 / 256, 300)
VALUES = "-inf -1 -0 1 2 7.5 16 255 300 32767 65534 65535 inf nan"


def _to_pixels(kind, **options):
    with np.errstate(invalid="ignore", over="ignore"):
        every, whole = [*map(float, VALUES.split())], kind[0] != "f"
        kept = [each for each in every if not whole or np.iinfo(kind).min <= each <= np.iinfo(kind).max]
        values = np.array([kept, kept[::-1]]).astype(kind)
    stored = decode_stored(encode_stored(values, "npy"), "x")
    found = _answer(encodings.to_disparity, stored, **options)
    if isinstance(found, str):
        return found
    return [found.encoding, str(found.disparity.dtype), found.disparity.ravel(), found.warnings]


def _plateau(make):
    found = encodings.to_disparity(decode_stored(encode_stored(make().astype(np.float32), "npy"), "x"))
    return [found.warnings, (found.disparity > 0).sum(axis=1)[::20]]


ROAD = np.arange(200.0)[:, None] * 0.5 + 3 + np.linspace(0, 1, 300)
PLATEAUS = {
    "none": lambda: ROAD,
    "largest": lambda: np.minimum(ROAD, 80.0),
    "few": lambda: np.minimum(ROAD, 102.0),
    "smallest": lambda: np.where((np.indices(ROAD.shape).sum(axis=0) % 3) == 0, 2.0, ROAD),
    "mark and edge": lambda: np.where(
        (np.indices(ROAD.shape).sum(axis=0) % 3) == 0, 2.0, np.where(ROAD < 8, 3.0, ROAD)
    ),
    "steps": lambda: np.broadcast_to(np.arange(200)[:, None] // 12 + 3.0, (200, 300)),
    "one number": lambda: np.full((200, 300), 7.0),
    "small": lambda: np.minimum(ROAD, 60.0)[::11, ::17],
}
CALIBRATIONS = {
    "none": None,
    "no baseline": Calibration(fx=100, fy=100, cx=1, cy=0.5),
    "whole": Calibration(fx=100, fy=100, cx=1, cy=0.5, baseline=0.5, doffs=12.5),
}
ROWS = {
    "numbers": Row(
        "a", **{name: 1.23456789012 for name, kind in column_types(FURTHER).items() if kind is float}
    ),
    "small": Row(
        'a"b.png', roll_deg=-1e-9, alpha2=-3.83765039123e-09, right_twist_px=-0.00001, converged=True
    ),
    "edge": Row("a\nb\r.png", roll_deg=-89.9999999, image_roll_deg=-89.9999999, message="one, two"),
    "no numbers": Row("\udcff=ü/雨.png", rmse_px=math.nan, alpha0=math.inf, global_minimum=False),
}


def _written(row):
    texts = [format_row(row, form, FURTHER) for form in ("csv", "jsonl")]
    whole = [format_header(form, FURTHER) + text for form, text in zip(("csv", "jsonl"), texts, strict=True)]
    assert [format_row(next(iter(parse_rows(each, "x"))), "csv", FURTHER) for each in whole] == texts[:1] * 2
    return [text.decode("latin-1") for text in texts]


def _members():
    """What is read of archives, whole and damaged: of members as large as may be and a byte larger."""
    files = {"noise": np.random.default_rng(1).bytes(500), "d/zeros": bytes(5000)}
    files |= dict.fromkeys((".b", "__MACOSX/c", "d/.e/f"), b"x")
    made, found = {}, {}
    with folder_of([]):
        for name, packing in (("a.zip", zipfile.ZIP_STORED), ("b.zip", zipfile.ZIP_DEFLATED)):
            with zipfile.ZipFile(name, "w", packing) as file:
                for each, data in files.items():
                    file.writestr(each, data)
        with tarfile.open("c.tar", "w", format=tarfile.USTAR_FORMAT) as file:
            for each, data in files.items():
                Path("file").write_bytes(data)
                file.add("file", f"./{each}" if each == "noise" else each)
        for name in ("a.zip", "b.zip", "c.tar"):
            whole = made[name] = Path(name).read_bytes()
            made[f"cut {name}"], made[f"bad {name}"] = whole[:700], whole[:99] + b"other" + whole[104:]
            made[f"locked {name}"] = whole.replace(b"\x14\0\0\0", b"\x14\0\1\0")
        for name, data in made.items():
            Path(name).write_bytes(data)
        for name in (*made, "no.zip", "no.tar"):
            listed = _answer(lambda name=name: list(containers.members(name)))
            places = [f"{name}#{each}" for each in ("noise", "d/zeros", "x")]
            places += [place for place, _ in (() if isinstance(listed, str) else listed) if "#@" in place]
            read = {each: [_member(each, most) for most in (499, 500, 4999, 5000)] for each in places}
            found[name] = [listed, read]
    return found


def _member(location, most):
    found = _answer(containers.read_member, location, "name", most)
    return found if isinstance(found, str) else [len(found), sum(found)]


def _tiff(**layout):
    return _map(tiff_by_tifffile(disparity_map().astype(np.float32), **layout))


CASES = {
    **{line: partial(_read, line) for line in filter(None, INPUTS.split("\n"))},
    **{f"file: {name}": partial(_map, data) for name, data in FILES.items()},
    **{
        f"image: {name}": partial(READ["image"], data)
        for name, data in FILES.items()
        if name != "picture.jpg"  # libjpeg rounds in more than one way
    },
    # of the largest size, and by a space longer
    "npy: long headers": lambda: [
        READ["npy"](b"{'descr': '<f4', 'fortran_order': False, 'shape': (5, 5)".rjust(size))
        for size in (10_000, 10_001)
    ],
    "image: a header without end": partial(READ["image"], b"P5\n#%s\n2 2\n255\n1234" % (b"x" * 3000)),
    # a compressed file is as long as this zlib makes it
    **{
        f"cut: {name}": partial(lambda data: [_cut(data[:end]) for end in (9, -1)], data)
        for name, data in FILES.items()
        if name.endswith((".npy", ".pfm", ".ppm", ".pgm", ".bmp"))
    },
    **{
        f"pixels: {kind}, {encoding}": partial(_to_pixels, kind, encoding=encoding)
        for kind in ("u1", "u2", "i2", "i4", "f2", "f4", "f8")
        for encoding in ("auto", "px", "kitti", "cityscapes", "sgbm", "depth")
    },
    **{
        f"pixels: {kind}, scale {scale}": partial(
            _to_pixels, kind, scale=scale, invalid=(7.5, 16.0, math.nan)
        )
        for kind in ("u2", "i2", "f4")
        for scale in (0.25, -0.5, 0.0, math.inf)
    },
    **{
        f"depth: {name}": partial(_to_pixels, "f4", encoding="depth", calibration=each, invalid=(2.0,))
        for name, each in CALIBRATIONS.items()
    },
    "pixels: unknown": partial(_to_pixels, "f4", encoding="middlebury"),
    "stored as KITTI's": lambda: encodings.to_kitti(np.array([[0, -1, np.nan, np.inf, *SMALL_AND_LARGE]])),
    **{f"plateau: {name}": partial(_plateau, make) for name, make in PLATEAUS.items()},
    **{f"row: {name}": partial(_written, row) for name, row in ROWS.items()},
    "tiff: deflate": partial(_tiff, compression="zlib", predictor=True, rowsperstrip=9),
    "tiff: described": partial(_tiff, description="height over the road", software="by hand"),
    "differences": lambda: [
        list(locking.differences({"rollcli": one, "options": was}, {"rollcli": "1", "options": now}))
        for one in "12"
        for was, now in (
            ({"a": 1, "b": None, "c": [1, 2], "d": True}, {"a": 2, "b": "y", "c": None, "d": False}),
            ({"a": 1}, {"a": 1}),
        )
    ],
    "sizes": lambda: [bounded.in_words(size) for size in (0, 999, 1 << 20, 3 << 19, 1 << 30, 5 << 40)],
    "halves": lambda: [
        _answer(
            lambda shape=shape, layout=layout: [
                half.shape for half in pictures.views_of(np.zeros(shape), layout, "x")
            ]
        )
        for shape in ((4, 6), (5, 7), (4, 6, 3), (1, 1))
        for layout in ("left-right", "top-bottom")
    ],
    "members": _members,
    **answers.CASES,
    **small_bags.CASES,
    "listed": lambda: [listed("abcdefg"[:count]) for count in range(6)],
}


@pytest.mark.parametrize("case", CASES)
def test_answers_are_those_recorded(case):
    if case.startswith(("found ", "url ")) and os.name == "nt":
        pytest.skip("fewer names are those of files, and folders are not to be read otherwise")
    check("files", case, CASES[case]())
