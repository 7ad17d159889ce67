"""What a matcher writes for pixels without a match is no data, also where it is a positive number."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import to_disparity
from rollcli.files.formats import Stored, read_stored
from tests.run_cli import rollcli

REALMAPS = Path(__file__).parents[2].parent / "shared" / "realmaps"
TRUTHS = {"frame_0001": -8.0, "frame_0003": 12.0, "frame_0004": -4.0}


def opencvs_own(name, first):
    left, right = (cv2.imread(f"sample_data/{side}/{name}.png", 0) for side in ("left", "right"))
    return cv2.StereoSGBM.create(first, 64, 5, 100, 400, 1, uniquenessRatio=10).compute(left, right)


@pytest.mark.parametrize(("name", "truth"), TRUTHS.items())
@pytest.mark.parametrize("first", [10, 20])
@pytest.mark.parametrize("form", ["int16", "float32", "uint16"])
def test_the_mark_of_opencv_is_no_data_whatever_its_range_begins_with(tmp_path, name, truth, first, form):
    values = opencvs_own(name, first)
    known = values > 16 * first  # where it begins, the best match may lie beyond
    assert (np.unique(values[~known]) == [16 * (first - 1), 16 * first]).all()
    assert (~known).mean() > 0.2
    values = {"int16": values, "float32": values / np.float32(16), "uint16": values.astype(np.uint16) * 16}[
        form
    ]

    found = to_disparity(Stored(values, "npy"))

    assert not found.disparity[~known].any()
    assert found.warning is not None
    assert f"the smallest, {first - 1} px: they are taken as no data" in found.warning
    np.save(tmp_path / "map.npy", values)
    done = rollcli("estimate", "map.npy", cwd=tmp_path)
    assert done.status == 0
    assert float(next(csv.DictReader(done.out.splitlines()))["roll_deg"]) == pytest.approx(truth, abs=0.2)
    assert "taken as no data" in done.err


def test_a_largest_number_that_stands_for_all_beyond_it_is_no_data():
    rows = np.arange(200, dtype=np.float32)[:, None]
    values = np.minimum(rows * 2.0 + 3 + np.linspace(0, 1, 300, dtype=np.float32), 255).astype(np.float32)

    found = to_disparity(Stored(values, "npy"))

    assert (found.disparity[:125] > 0).all()
    assert not found.disparity[127:].any()
    assert abs(np.degrees(estimate_roll(found.disparity).theta)) < 0.2


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_steps_of_a_road_and_a_map_of_one_number_stay(kind):
    rows = np.arange(200)[:, None] // 12 + 3
    steps = np.broadcast_to(rows, (200, 300)).astype(kind)
    for values in (steps, np.full((200, 300), 7, kind)):
        found = to_disparity(Stored(values, "npy"))
        np.testing.assert_array_equal(found.disparity, values)
        assert found.warning is None


@pytest.mark.skipif(not REALMAPS.is_dir(), reason="needs the real maps beside the project")
@pytest.mark.parametrize("kind", ["network", "post", "raw", "refined", "sgm"])
def test_no_real_map_has_such_a_plateau(kind):
    files = sorted((REALMAPS / kind).glob("*.png"))
    assert files
    for file in files:
        assert "taken as no data" not in (to_disparity(read_stored(file), scale=1.0).warning or ""), file
