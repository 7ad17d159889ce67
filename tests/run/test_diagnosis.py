"""What is no disparity map in pixels is told what it looks like, and nothing else is."""

import cv2
import numpy as np
import pytest

from rollcli.files.encodings import read_disparity, to_disparity
from rollcli.files.formats import Stored, read_stored
from rollcli.run.diagnosis import looks_like, require_positive
from rollcli.run.options import FramesOptions
from tests.real_pairs import REALMAPS, STREETS
from tests.run_cli import ROOT, road_map

SAMPLES = sorted((ROOT / "sample_data" / "maps").iterdir())
PHOTOGRAPHS = sorted((ROOT / "sample_data").glob("[lr]*t/*.png"))
PHOTOGRAPH, DEPTH, UPSIDE_DOWN = "looks like a photograph", "looks like a depth map", "upside down"


def verdict(values):
    stored = Stored(np.ascontiguousarray(values), "npy")
    return looks_like(to_disparity(stored).disparity, stored, FramesOptions())


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.name)
def test_a_map_is_taken_for_nothing_else_and_its_depths_and_its_reverse_are_known(path):
    disparity = read_disparity(path)
    depth = np.where(disparity > 0, 150 / np.where(disparity > 0, disparity, 1), 0)

    assert verdict(read_stored(path).values) == ""
    assert verdict(np.rint(disparity * (255 / disparity.max())).astype(np.uint8)) == ""  # stretched
    assert DEPTH in verdict(depth.astype(np.float32))
    assert DEPTH in verdict((depth / 1000).astype(np.float32))  # in km
    assert DEPTH in verdict(np.clip(np.rint(1000 * depth), 0, 65535).astype(np.uint16))
    assert UPSIDE_DOWN in verdict(disparity[::-1])  # or a depth map: few roads tell which
    assert "--scale -1" in verdict(np.where(np.arange(len(disparity))[:, None] < 9, 0.2, -disparity))


@pytest.mark.parametrize("path", PHOTOGRAPHS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_photographs_of_8_and_16_bits_are_known(path):
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    for values in (grey, grey.astype(np.uint16) * 257, grey.astype(np.uint16) * 16):
        assert PHOTOGRAPH in verdict(values)


def test_noise_walls_and_small_maps_are_taken_for_nothing():
    random = np.random.default_rng(0)
    assert verdict(random.integers(0, 256, (120, 160), dtype=np.uint8)) == ""
    assert verdict(np.full((120, 160), 40, np.uint8)) == ""
    assert verdict(np.array([[1], [2]], np.uint8)) == ""
    assert verdict(np.zeros((5, 5), np.float32)) == ""
    assert looks_like(road_map(), None, FramesOptions()) == ""  # matched from a pair


def test_real_maps_and_photographs_are_told_apart():
    folders = ("raw", "refined", "sgm", "post", "network")
    maps = [str(path) for each in folders for path in sorted(REALMAPS.glob(f"{each}/*.png"))[3::8]]
    photographs = [str(path) for path in sorted(STREETS.glob("left/*.png"))[::4]]
    if not (maps and photographs):
        pytest.skip(f"the real maps and photographs are not there: {REALMAPS}, {STREETS}")
    assert [path for path in maps if verdict(cv2.imread(path, cv2.IMREAD_UNCHANGED))] == []
    assert all(PHOTOGRAPH in verdict(cv2.imread(path, cv2.IMREAD_GRAYSCALE)) for path in photographs)


@pytest.mark.parametrize(
    "values",
    [
        np.full((9, 9), -16, np.int16),
        np.zeros((9, 9)),
        road_map() - 30,
        np.full((9, 9), np.nan),
        np.array([[np.nan, -2.0, -1.0], [3.0, 4.0, 5.0]]),
        np.array([[-np.inf, -np.inf]]),
    ],
    ids=["no data", "zero", "both signs", "nan", "nan and both signs", "infinite"],
)
def test_a_map_without_disparities_is_not_asked_for_its_sign(values):
    require_positive(Stored(values, "npy"), "a.npy")
