"""Mistakes, typical and unexpected, and the answer to each: the exact line, and the exit status."""

import re
import shlex
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli.files.atomic import in_threads, sync_files
from rollcli.files.encodings import read_disparity
from rollcli.files.results import Row, format_header, format_row
from rollcli.files.storage import fetch_all
from tests.run_cli import ROOT, contents, road_map, rollcli, write_kitti, write_pair

FRAMES = 1
SAMPLES = ROOT / "sample_data"
TABLE = Path(__file__).with_name("mistakes.txt").read_text("utf-8")
ANSWERS = re.findall(r"^\$ (.+)\n(\d+): (.+)$", TABLE, flags=re.MULTILINE)


def depth_of(disparity):
    return np.where(disparity > 0, 150 / np.where(disparity > 0, disparity, 1), 0).astype(np.float32)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What a new user may have at hand."""
    folder = tmp_path_factory.mktemp("mistakes")
    for name in ("a", "b"):
        write_kitti(folder / "maps" / f"{name}.png", road_map(0.02))
    road = road_map(0.02)
    photo = cv2.imread(str(SAMPLES / "left" / "frame_0001.png"))
    cv2.imwrite(str(folder / "photo.png"), photo[..., 0])
    cv2.imwrite(str(folder / "colour.png"), cv2.merge([photo[..., 0]] * 3))
    cv2.imwrite(str(folder / "photo.jpg"), photo)
    np.save(folder / "colour.npy", cv2.merge([photo[..., 0]] * 3))
    street, rolled = (read_disparity(SAMPLES / "maps" / f"frame_{n}") for n in ("0001.png", "0003.tiff"))
    np.save(folder / "depth.npy", depth_of(rolled))
    millimetres = np.clip(np.rint(1000 * depth_of(street)), 0, 65535)
    cv2.imwrite(str(folder / "depth.png"), millimetres.astype(np.uint16))
    np.save(folder / "x16.npy", road * 16)
    np.save(folder / "x256.npy", road * 256)
    np.save(folder / "negative.npy", -road)
    np.save(folder / "reversed.npy", street[::-1])
    np.save(folder / "mask.npy", road > 0)
    np.save(folder / "empty.npy", np.zeros((120, 160), np.float32))
    cv2.imwrite(str(folder / "whole.png"), np.rint(road).astype(np.uint16))
    (folder / "notes.txt").write_text("bring the camera\n")
    (folder / "cut.png").write_bytes((folder / "maps" / "a.png").read_bytes()[:999])
    write_kitti(folder / "copy" / "a.png", road_map(0.02))
    (folder / "nothing").mkdir()
    (folder / "photos").mkdir()
    cv2.imwrite(str(folder / "photos" / "1.jpg"), photo)
    for name in ("1.png", "2.png"):
        write_pair(folder, name, road_map(0.05, width=320, height=160) / 2)
    for side, names in (("cam_a", ("0001", "0003")), ("cam_b", ("0002", "0004"))):
        (folder / side).mkdir()
        for name, original in zip(names, ("1.png", "2.png"), strict=True):
            source = folder / ("left" if side == "cam_a" else "right") / original
            (folder / side / f"{name}.png").write_bytes(source.read_bytes())
    cv2.imwrite(str(folder / "small.png"), np.zeros((60, 80), np.uint8))
    rows = [Row("maps/a.png", status="ok", roll_deg=1.0), Row("maps/b.png", status="suspect", roll_deg=2.0)]
    text = format_header("csv") + b"".join(format_row(row, "csv") for row in rows)
    (folder / "rolls.csv").write_bytes(text)
    (folder / "truth.csv").write_text("file,roll_deg\nz,1\n")
    return folder


@pytest.mark.parametrize(("line", "status", "answer"), ANSWERS, ids=[line for line, *_ in ANSWERS])
def test_a_typical_mistake_gets_its_answer(folder, line, status, answer):
    before = contents(folder)
    done = rollcli(*shlex.split(line)[1:], cwd=folder, status=int(status))
    assert f"rollcli: {answer}" in done.err.splitlines()
    if status == "2":
        assert (done.refused(), contents(folder)) == (f"rollcli: {answer}\n", before)


def test_the_table_is_read_whole():
    assert len(ANSWERS) == TABLE.count("\n$ ") >= 25


@pytest.mark.parametrize("command", ["rig", "report"])
@pytest.mark.parametrize(
    ("kind", "value"),
    [("duration", 2**62), ("duration", 1), ("date32", 2**31 - 1), ("date32", 1), ("time64", 1)],
)
def test_times_of_parquet_are_no_angles(tmp_path, command, kind, value):
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
    from pyarrow import parquet

    types = {"duration": pyarrow.duration("s"), "date32": pyarrow.date32(), "time64": pyarrow.time64("ns")}
    angles = pyarrow.array([value], types[kind])
    table = pyarrow.table({"file": ["a.png"], "status": ["ok"], "roll_deg": angles})
    parquet.write_table(table, tmp_path / "r.parquet")
    further = ["--svg", "s"] if command == "report" else []
    refusal = rollcli(command, "r.parquet", *further, cwd=tmp_path).refused()
    assert "rollcli: r.parquet: " in refusal


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "[" * 100_000, "is not TOML: maximum recursion depth exceeded"),
        ("seed = " + "1" * 5000, "is not TOML: Exceeds the limit"),
        (".".join(["a"] * 50_000) + " = 1", "is no file of options: it has a key of more than 8 parts"),
        ("[" + ".".join(['"a"'] * 50_000) + "]", "is no file of options: it has a key of more than 8 parts"),
    ],
)
def test_a_file_of_options_that_was_made_to_harm_is_refused_by_its_name(maps, text, reason):
    (maps / "rollcli.toml").write_text(text)
    refusal = rollcli("estimate", "maps", "--config", "rollcli.toml", cwd=maps).refused()
    assert refusal.startswith("rollcli: rollcli.toml: ")
    assert reason in refusal


@pytest.mark.parametrize("threads", [0, 1])
def test_where_the_system_starts_no_more_threads_the_others_do_it_all(tmp_path, monkeypatch, threads):
    start, started = threading.Thread.start, []

    def starts_few(self):
        if len(started) == threads:
            raise RuntimeError("can't start new thread")
        started.append(self)
        start(self)

    monkeypatch.setattr(threading.Thread, "start", starts_few)
    files = [tmp_path / f"{number}" for number in range(40)]
    for file in files:
        file.write_bytes(b"x")
    sync_files(files)
    assert in_threads(len, [[0] * number for number in range(40)]) == list(range(40))
    assert list(fetch_all(map(str, files)).values()) == [b"x"] * 40
