"""Whole texts and bags that the program reads, each with the command that reads it."""

import atexit
import ntpath
import os
import posixpath
import shutil
import tempfile
from collections.abc import Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from rollcli.errors import UsageError
from rollcli.files.stores.locations import (
    base_name,
    is_object_url,
    is_url,
    names_a_file,
    public_name,
    split_url,
    store_of,
)
from tests.rig.calibration_files import KALIBR, WHOLE, Rig, written
from tests.run_cli import road_map, rollcli, write_maps

MAPS, RESULT, RECORD, INPUTS = "maps", "rolls.csv", "rolls.csv.run.json", "rolls.csv.inputs"
READ_BY = {
    "results": ("rig", "text"),
    "records": ("estimate", MAPS, "-o", RESULT, "--resume"),
    "settings": ("estimate", MAPS, "--config", "text", "--dry-run"),
    "calibrations": ("estimate", MAPS, "--calib", "text", "--dry-run"),
    "truths": ("evaluate", "accuracy", RESULT, "--truth", "text"),
    "lists": ("estimate", "--files-from", "text", "--dry-run"),
    "inputs": ("estimate", MAPS, "-o", RESULT, "--update", "-j1"),
    "bags": ("estimate", "-j1", "text.{}"),  # by its ending
    "urls": (),  # by no command: one would ask the servers that they name
}
_SAMPLES = {path.stem: path.read_text("utf-8") for path in Path(__file__).with_name("samples").iterdir()}
_LIST = "".join(f"maps/frame{index}.png\n" for index in range(3))
_RIG = Rig(fx=140.5, fy=140.5, cx=79.2, cy=58.9, width=160, height=120)
# 3: `evaluate` has no angle for a name; 4: `rig` has too few rows to tell
_ENDED = {0: "read", 3: "read", 4: "read", 2: "refused"}


def texts(readers: Iterable[str] = READ_BY) -> dict[str, bytes]:
    """Bytes of each text of these readers, by reader/name."""
    asked = set(readers).intersection(READ_BY)
    return {name: text for name, text in _whole().items() if name.partition("/")[0] in asked} if asked else {}


@cache
def _whole() -> dict[str, bytes]:
    folder = _workplace()
    rolls = (folder / RESULT).read_bytes()
    assert rollcli("estimate", MAPS, "-o", "rolls.jsonl", cwd=folder).status == 0
    parquet = {}
    if find_spec("pyarrow"):  # the extra
        assert rollcli("estimate", MAPS, "-o", "rolls.parquet", cwd=folder).status == 0
        parquet["results/parquet"] = (folder / "rolls.parquet" / "part-00000.parquet").read_bytes()
    return {
        "results/csv": rolls,
        "results/jsonl": (folder / "rolls.jsonl").read_bytes(),
        **parquet,
        "records/json": (folder / RECORD).read_bytes(),
        "inputs/txt": (folder / INPUTS).read_bytes(),
        **(_bags(folder) if find_spec("rosbags") else {}),  # the extra
        "settings/toml": _SAMPLES["settings"].encode(),
        "truths/csv": _SAMPLES["truth"].encode(),
        "lists/txt": _LIST.encode(),
        "lists/print0": _LIST.replace("\n", "\0").encode(),
        "lists/utf-16": _LIST.replace("\n", "\r\n").encode("utf-16"),
        "results/utf-16": rolls.decode().encode("utf-16"),
        "settings/utf-16": _SAMPLES["settings"].encode("utf-16"),
        "urls/txt": _SAMPLES["urls"].encode(),
        "calibrations/unrectified-kalibr": KALIBR.encode(),
        "calibrations/unrectified-zed": written("zed", _RIG).encode(),
        **{f"calibrations/{form}": written(form, _RIG).encode() for form in WHOLE},
    }


def _bags(folder: Path) -> dict[str, bytes]:
    """A bag of each kind, of small maps: what is broken is the bag more often than its maps."""
    from tests.files.recordings.bag_files import disparity_image, write_bag

    def messages(store):
        for number in range(3):
            values = road_map(0.1 * number, width=32, height=24, seed=number)
            yield "/disparity", number, disparity_image(store, values, number + 1)

    kinds = ("bag", "db3", "mcap")
    return {f"bags/{kind}": write_bag(folder, f"whole-{kind}", kind, messages).read_bytes() for kind in kinds}


def _read_urls(data: bytes) -> str:
    """Take each line for a URL, and check what is made of it by the rules of both systems."""
    answer = "read"
    for line in data.decode("utf-8", "surrogateescape").splitlines():
        if not is_url(line):
            continue
        public_name(line), store_of(line)
        try:
            name = base_name(line)
            if is_object_url(line):
                name = split_url(line)[1]
        except UsageError:
            answer = "refused"
            continue
        if names_a_file(name):
            for system, folder in ((posixpath, "/out"), (ntpath, r"C:\out")):
                place = system.normpath(f"{folder}{system.sep}{name}")
                if not place.startswith(f"{folder}{system.sep}") or "\0" in place:
                    raise ValueError(f"{line!r} leads to {place!r}")
    return answer


def read_text(data: bytes, name: str) -> str:
    """ "read" or "refused" by the command that reads such texts; anything else is raised."""
    reader = name.partition("/")[0]
    if reader == "urls":
        return _read_urls(data)
    folder = _workplace()
    kind = name.partition("/")[2]
    given = {
        RESULT: _whole()["results/csv"],
        RECORD: _whole()["records/json"],
        INPUTS: _whole()["inputs/txt"],
    }
    given[{"records": RECORD, "inputs": INPUTS, "bags": f"text.{kind}"}.get(reader, "text")] = data
    for each, content in given.items():
        (folder / each).write_bytes(content)
    done = rollcli(*(word.format(kind) for word in READ_BY[reader]), cwd=folder)
    answer = _ENDED.get(done.status, "")
    said = done.err.startswith(("rollcli: ", "Usage: rollcli "))
    if not answer or "internal error" in done.err or (answer == "refused" and not said):
        raise ValueError(f"ended with {done.status}: {done.err!r:.300}")
    return answer


@cache
def _workplace() -> Path:
    """A folder with maps and a result of them."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    write_maps(folder / MAPS, 12)
    for each in (folder / MAPS).iterdir():  # a record holds the times: another process makes the same one
        os.utime(each, (0, 0))
    assert rollcli("estimate", MAPS, "-o", RESULT, cwd=folder).status == 0
    return folder
