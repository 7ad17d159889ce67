"""Sessions at a prompt: what is typed, and all that the program then says and writes.

``tests/PACKAGE/sessions.txt`` has a heading, ``#``, before each session; what is typed follows a ``$``. Below
it stand the exit status, standard error (``!``) and output (``>``), and which files came (``+``), changed
(``~``) and went (``-``). ``python -m tests.recorded`` writes all of that anew. A session begins in a folder
with maps, pairs, masks and a calibration; beside ``rollcli`` it knows the tools below, and ``| fields NAME``
shows columns of a CSV. A heading ends with the package that its session needs, in brackets; of more than a
second, it says (slow). Run times are left out, and numbers may differ in their last digit.
"""

import contextlib
import csv
import io
import json
import os
import re
import shlex
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli import __version__
from rollcli.files.results import ALIGNMENT_COLUMNS, Row, format_header, format_row
from tests.rig.drive.series import drive
from tests.run_cli import contents, keep_rows, road_map, rollcli, write_kitti, write_maps, write_pair
from tests.slow import mostly_slow

_NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+\.(\d+)(?:e([-+]\d+))?(?![\w.])")
_TIMES = re.compile(r"[\d.]+ (?=s\b|frames/s|MB)")
_CAMERA = "P{}: 100 0 79.5 {} 0 100 59.5 0 0 0 1 0\n"
_PACKED = (".parquet", ".bag", ".db3", ".mcap", ".zip", ".tar")
_SHARE = 2e-4  # of a number, that versions of NumPy and OpenCV may differ by


def path_of(package):
    """Where the sessions of a package are."""
    return Path(__file__).parent / package / "sessions.txt"


def sessions(package):
    """The steps of each session by its heading: what is typed, and the lines of what came of it."""
    read, steps = {}, []
    for line in path_of(package).read_text("utf-8").split("\n"):
        if line.startswith("# "):
            steps = read.setdefault(line[2:], [])
        elif line.startswith("$ "):
            steps.append((line[2:], []))
        elif line and steps:
            steps[-1][1].append(line)
    return read


def check(package, heading, folder):
    """Fail where a session does not go as it is written down."""
    if os.name == "nt":
        pytest.skip("names and errors of files are those of POSIX")
    for needed in re.findall(r"\[(\w+)\]$", heading):
        pytest.importorskip(needed, reason=f"{needed}, of an extra, is not here")
    make_home(folder)
    for line, expected in sessions(package)[heading]:
        found = play(folder, line)
        assert [line, *map(_as_known, found, [*expected, *found][: len(found)])] == [line, *expected]


def record(package, folder):
    """Write down anew how the sessions of a package go."""
    before, *_ = path_of(package).read_text("utf-8").partition("\n# ")
    parts = [before.rstrip("\n")]
    for number, (heading, steps) in enumerate(sessions(package).items()):
        home = folder / f"{package}{number}"
        home.mkdir(parents=True)
        make_home(home)
        lines = [each for line, _ in steps for each in (f"$ {line}", *play(home, line))]
        parts.append("\n".join([f"# {heading}", *lines]))
    path_of(package).write_text("\n\n".join(parts) + "\n", "utf-8", newline="\n")


def _as_known(found, known):
    """The line with the numbers of the known one, where they are no more than a last digit apart."""
    numbers = iter(list(_NUMBER.finditer(known)))

    def known_if_near(match):
        other = next(numbers, match)
        place = 10.0 ** (int(match[2] or 0) - len(match[1]))
        one, two = (float(each[0].replace("−", "-")) for each in (match, other))
        return other[0] if abs(one - two) <= 1.5 * place + _SHARE * abs(two) else match[0]

    return _NUMBER.sub(known_if_near, found)


def make_home(folder):
    """Write the inputs of a session."""
    write_maps(folder / "maps", 3)
    write_kitti(folder / "masks" / "frame1.png", np.eye(120, 160) + 1)
    for index in range(2):
        write_pair(folder, f"{index}.png", road_map(0.05, width=320, height=160, seed=index) / 2, seed=index)
    (folder / "calib.txt").write_text(_CAMERA.format(0, 0) + _CAMERA.format(1, -50), newline="\n")


def play(folder, line):
    """Do what is typed; return the lines of what came of it."""
    before, line = contents(folder), line.replace("VERSION", __version__)
    words = line.split(" ", 2) if line.startswith("write ") else shlex.split(line)
    words, fields = (
        (words[: words.index("|")], words[words.index("|") + 2 :]) if "|" in words else (words, [])
    )
    if words[0] in _TOOLS:
        said = [f"> {each}" for each in _TOOLS[words[0]](folder, *words[1:]) or ()]
    else:
        variables = {}
        while words[0] != "rollcli":
            name, _, variables[name] = words.pop(0).partition("=")
        stdin = (folder / words.pop()).read_text("utf-8") if words[-2:-1] == ["<"] else ""
        done = rollcli(*[each for each in words[1:] if each != "<"], cwd=folder, stdin=stdin, **variables)
        out = _fields(done.out, fields) if fields else done.out
        said = [f"= {done.status}", *_marked("!", done.err), *_marked(">", out)]
    return [_anonymous(each, folder) for each in (*said, *_changes(before, contents(folder)))]


def _marked(mark, text):
    return [f"{mark} {each}" for each in text.removesuffix("\n").split("\n")] if text else []


def _anonymous(line, folder):
    line = line.replace("[COMMAND]", "COMMAND")  # as click calls it before 8.2
    return _TIMES.sub("… ", line.replace(str(folder), "FOLDER").replace(__version__, "VERSION"))


def _fields(text, names):
    """Columns of a CSV."""
    rows = [[row[name] for name in names] for row in csv.DictReader(io.StringIO(text))]
    return "\n".join(map(",".join, rows))


def _changes(before, after):
    for name in sorted({*before, *after}):
        if name not in after:
            yield f"- {name}"
        elif after[name] != before.get(name):
            yield f"{'~' if name in before else '+'} {name}: {_described(name, after[name])}"


def _described(name, data):
    """Of a map its numbers, of a picture its size, of a text how many lines it has."""
    if name.endswith((*_PACKED, ".svg", ".pdf", ".html", ".yaml")):
        return "a file"
    if not name.endswith((".png", ".tif", ".npy")):
        return f"{data.count(10)} lines"
    try:
        if name.endswith(".npy"):
            values = np.load(io.BytesIO(data))
        else:
            values = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        size = "x".join(map(str, values.shape[::-1]))
    except (ValueError, AttributeError, cv2.error):
        return f"{len(data)} bytes"
    if values.ndim > 2:
        return f"{values.dtype} {size}"
    known = values[np.isfinite(values)].astype(float)
    spread = f"mean {known.mean():.4f}, sd {known.std():.4f}"
    return f"{values.dtype} {size}, {spread}, {(known != 0).mean():.3f} of it not zero"


def _write(folder, name, text=""):
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(text.encode().decode("unicode_escape").encode("latin-1"))


def _copy(folder, one, other):
    (folder / other).parent.mkdir(parents=True, exist_ok=True)
    copy = shutil.copytree if (folder / one).is_dir() else shutil.copyfile
    copy(folder / one, folder / other)


def _link(folder, name, target):
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).symlink_to(target)


def _edit(folder, name, old, new):
    text = (folder / name).read_text("utf-8")
    assert old in text
    (folder / name).write_text(text.replace(old, new), "utf-8", newline="\n")


def _remove(folder, *names):
    for name in names:
        place = folder / name
        shutil.rmtree(place) if place.is_dir() else place.unlink()


def _map(folder, name, roll="0.1", times="1"):
    """Write a road that is rolled by radians, as KITTI has it, or its numbers as they are into NPY."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    disparity = road_map(float(roll), seed=9) * float(times)
    np.save(folder / name, disparity) if name.endswith(".npy") else write_kitti(folder / name, disparity)


def _pack(folder, name, packed):
    """Pack a folder as ZIP or tar, by the ending."""
    stem, _, form = name.rpartition(".")
    shutil.make_archive(str(folder / stem), form, folder / packed)


def _pair(folder, name, roll, width, nearer="0"):
    """Write PLACE/left/NAME and PLACE/right/NAME: a road, all of it so many pixels of disparity nearer."""
    place, _, view = name.rpartition("/")
    write_pair(folder / place, view, road_map(float(roll), width=int(width)) / 2 + float(nearer))


def _same(folder, one, other):
    """Tell whether the bytes of two files are the same."""
    return ["yes" if (folder / one).read_bytes() == (folder / other).read_bytes() else "no"]


def _sql(folder, name, statement):
    """Change a bag of SQLite."""
    with contextlib.closing(sqlite3.connect(folder / name)) as base, base:
        base.execute(statement)


def _rows(folder, name, count, further="0"):
    """Keep so many rows of a result, and bytes of a further one."""
    keep_rows(folder / name, int(count), int(further))


def _rig(folder, name, *settings):
    """Write the result of a simulated drive, with pitch, height and how the views of its pairs lie."""
    given = {key: json.loads(value) for key, _, value in (each.partition("=") for each in settings)}
    place, pairs = given.pop("folder", "run"), given.pop("pairs", 0.0)
    statuses = {int(number): "suspect" for number in given.pop("suspect", [])}
    rows = []
    for number, (value, error) in enumerate(zip(*drive(**given), strict=True)):
        roll, half = float(value), 1.96 * float(error)
        status = statuses.get(number, "ok")
        posed = {"pitch_deg": 3 - roll / 2, "pitch_ci95_deg": half, "height_m": abs(1.5 + roll / 9)}
        lies = dict.fromkeys(ALIGNMENT_COLUMNS, pairs + roll / 20) if pairs else {}
        frame = Row(f"{place}/{number}.png", "r.png" if pairs else "", status, roll, half, **posed, **lies)
        rows.append(replace(frame, height_ci95_m=half / 9, method="gd", width=320, height=240))
    form = "jsonl" if name.endswith("jsonl") else "csv"
    (folder / name).write_bytes(b"".join([format_header(form), *(format_row(row, form) for row in rows)]))


def _bag(folder, name, *topics):
    """Write a bag of two moments of topics NAME=KIND[*COUNT][+NS]: so many of them, and so much later.

    Kinds are maps (disparity, depth, mono16, png), views (view, packed), a photograph of a map's size,
    and CameraInfo: `info`, of a raw view (`raw`), or without a P (`none`).
    """
    from tests.files.recordings import bag_files

    given = [re.fullmatch(r"(.*)=(\w+)(?:\*(\d))?(?:\+(\d+))?", each).groups() for each in topics]
    width, height = (320, 160) if any(each[1] in ("view", "packed") for each in given) else (160, 120)
    k = (350.0, 0, width / 2, 0, 350, height / 2, 0, 0, 1)

    def message(store, number, stamp, topic, kind):
        right = "right" in topic
        values = road_map(0.05 * number, seed=number).astype(np.float32)
        view = cv2.imread(str(folder / ("right" if right else "left") / f"{number}.png"), 0)
        whole = np.rint(values * 256).astype(np.uint16)
        if kind == "disparity":
            return bag_files.disparity_image(store, values, stamp, number)
        if kind in ("info", "raw", "none"):
            p = (*k[:2], k[2] + right, -175.0 * right, *k[3:6], 0, *k[6:], 0)
            d = (-0.1, 0.02, 0, 0, 0) if kind == "raw" else ()
            return bag_files.camera_info(
                store, stamp, (width, height), p if kind != "none" else [0.0] * 12, d, k
            )
        if kind in ("png", "packed"):
            data = cv2.imencode(".png", whole if kind == "png" else view)[1].tobytes()
            return bag_files.compressed(store, data, kind, stamp)
        values, encoding = {
            "depth": (350 * 0.5 / np.maximum(values, 0.1), "32FC1"),
            "mono16": (whole, "mono16"),
            "photo": ((whole % 251).astype(np.uint8), "mono8"),
            "view": (view, "mono8"),
        }[kind]
        return bag_files.image(store, values, encoding, stamp, number)

    def messages(store):
        for number in range(2):
            for topic, kind, count, later in given:
                stamp = 1_700_000_000_123_456_789 + number * 100_000_000 + int(later or 0)
                if number < int(count or 2):
                    yield topic, stamp, message(store, number, stamp, topic, kind)

    stem, _, form = name.rpartition(".")
    bag_files.write_bag(folder, stem, form, messages)


def _show(folder, name):
    """Show a text; of JSON each value with where it stands."""
    text = (folder / name).read_text("utf-8")
    return list(_values(json.loads(text))) if name.endswith(".json") else text.splitlines()


def _values(value, place=""):
    if isinstance(value, dict) and value:
        for name, each in value.items():
            yield from _values(each, f"{place}.{name}" if place else name)
    else:
        yield f"{place}: {json.dumps(value)}"


_TOOLS = {
    "bag": _bag,
    "cp": _copy,
    "edit": _edit,
    "link": _link,
    "map": _map,
    "pack": _pack,
    "pair": _pair,
    "rm": _remove,
    "rows": _rows,
    "same": _same,
    "show": _show,
    "sql": _sql,
    "write": _write,
    "rig": _rig,
}


def parametrize(package):
    """Mark a test to be run with the heading of each session; those that draw charts take seconds."""
    every = sessions(package)
    quick = [each for each in every if "(slow)" not in each and "[plotly]" not in each]
    return pytest.mark.parametrize("heading", mostly_slow(every, *quick))
