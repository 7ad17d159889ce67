"""`rollcli derotate`: maps keep what they are, and every map gets its own angle."""

import math
from itertools import product

import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import encode_stored, read_stored
from rollcli.run import batch
from tests.run_cli import contents, interrupt_in, road_map, rollcli, write_kitti

FRAMES = 4
TYPES = {
    "png": ["u1", "u2"],
    "tiff": ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"],
    "npy": ["u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"],
    "pfm": ["f4"],
}
STEPS = {"px": 1, "kitti": 1 / 256, "cityscapes": 1 / 256, "sgbm": 1 / 16}
KINDS = [(form, dtype) for form, dtypes in TYPES.items() for dtype in dtypes]
COMBINATIONS = [
    (form, dtype, encoding)
    for (form, dtype), encoding in product(KINDS, STEPS)
    if encoding == "px" or dtype[1] > "1"
]


def written(folder, form, dtype, encoding):
    """A rolled road with holes, stored as asked for; where it is, and what it became."""
    disparity = road_map(math.radians(4), height=90) / 2 + 8
    disparity[20:30, 40:60], disparity[50:70, 100:150] = 0, 120  # no data, and what is much too large
    numbers = np.where(disparity > 0, disparity / STEPS[encoding] + (encoding == "cityscapes"), 0)
    stored = (numbers if dtype[0] == "f" else np.rint(numbers)).astype(dtype)
    ending = "tif" if form == "tiff" else form
    (folder / "maps").mkdir()
    (folder / "maps" / f"a.{ending}").write_bytes(encode_stored(stored, form))
    return folder / "maps" / f"a.{ending}", folder / "out" / f"a.{ending}"


@pytest.mark.parametrize(("form", "dtype", "encoding"), COMBINATIONS)
def test_a_map_keeps_its_format_type_and_encoding(tmp_path, form, dtype, encoding):
    before, after = written(tmp_path, form, dtype, encoding)

    line = ("derotate", "maps", "--roll", "4", "--encoding", encoding, "-o", "out", "-q")
    assert rollcli(*line, cwd=tmp_path).status == 0

    stored = read_stored(after)
    assert (stored.format, stored.values.dtype) == (form, np.dtype(dtype))
    assert stored.values.shape == read_stored(before).values.shape
    level = read_disparity(after, encoding=encoding)
    assert level.max() == pytest.approx(read_disparity(before, encoding=encoding).max(), rel=0.15)
    roll = estimate_roll(level, Request(road="all")).theta
    assert math.degrees(roll) == pytest.approx(0, abs=0.05 + 2 * STEPS[encoding])


@pytest.mark.parametrize("more", [(), ("--expand",)])
def test_the_matrix_says_where_each_pixel_has_gone(tmp_path, more):
    spots = {(40, 30): 20.0, (120, 90): 40.0, (80, 20): 60.0}  # (u, v), px
    values = np.full((121, 161), 5.0)
    for (u, v), disparity in spots.items():
        values[v - 2 : v + 3, u - 2 : u + 3] = disparity
    write_kitti(tmp_path / "maps" / "a.png", values)
    line = ("derotate", "maps", "--roll", "12.5", "--save-matrix", "-o", "out", *more)
    assert rollcli(*line, cwd=tmp_path).status == 0

    matrix = np.loadtxt(tmp_path / "out" / "a.txt")
    turned = read_disparity(tmp_path / "out" / "a.png")
    for (u, v), disparity in spots.items():
        rows, columns = np.nonzero(np.abs(turned - disparity) < 0.01)
        assert matrix @ (u, v, 1) == pytest.approx((columns.mean(), rows.mean(), 1), abs=0.5)
    centre = (np.array(turned.shape[::-1]) - 1) / 2
    assert matrix @ (80, 60, 1) == pytest.approx((*centre, 1))
    assert matrix[:2, :2] @ matrix[:2, :2].T == pytest.approx(np.eye(2))
    assert matrix @ (181, 60, 1) - matrix @ (81, 60, 1) == pytest.approx(
        (100 * math.cos(math.radians(12.5)), -100 * math.sin(math.radians(12.5)), 0)
    )
    assert "about its centre, (80, 60)" in (tmp_path / "out" / "a.txt").read_text()


def test_an_interrupted_run_says_that_what_is_written_is_whole(maps, monkeypatch):
    assert rollcli("derotate", "maps", "--roll", "2", "-o", "whole", cwd=maps).status == 0
    interrupt_in(monkeypatch, batch, "do_frame")
    done = rollcli("derotate", "maps", "--roll", "2", "-o", "out", cwd=maps, status=130)
    assert "interrupted; what is written is whole, and --overwrite starts anew" in done.err
    assert contents(maps / "out") == {"frame0.png": contents(maps / "whole")["frame0.png"]}


def test_copies_of_maps_are_known_by_the_calibration_that_the_maps_had(tmp_path):
    v, u = np.mgrid[:120, :320]
    across, down = (u - 99.5) / 200, v / 200
    # 1.5 m below the rig, a crown that falls by 11 cm 4 m to the side, where the roll is another one
    disparity = 100 / 3 * (down + np.sqrt(np.maximum(down**2 - 0.04 * across**2, 0)))
    for folder, name in product(("maps", "copies"), ("one.png", "two.png")):
        write_kitti(tmp_path / folder / name, np.where(down > 0.2, disparity, 0))
    camera = ("--focal", "200", "--principal-point", "99.5,0.1", "--baseline", "0.5")
    rollcli("estimate", "maps", *camera, "-o", "rolls.csv", cwd=tmp_path, status=0)
    # a suspect angle does not tell maps apart
    rows = (tmp_path / "rolls.csv").read_text().replace("two.png,,ok,-", "two.png,,ok,")
    (tmp_path / "rolls.csv").write_text(rows.replace("two.png,,ok,", "two.png,,suspect,1"))
    assert rollcli("derotate", "copies", "--from", "rolls.csv", "-o", "out", cwd=tmp_path, status=0).err
