"""Stored numbers become pixels, and no data becomes 0, whatever a file calls it and a plateau shows."""

import cv2
import numpy as np
import pytest

from rollcli.files.encodings import to_disparity
from rollcli.files.formats import Stored, read_stored
from tests.real_pairs import REALMAPS, needs_maps
from tests.run_cli import rollcli, rows_of


def test_the_stored_numbers_are_left_alone():
    values = np.array([[65535, -1, 5]], np.float32)
    values.flags.writeable = False

    to_disparity(Stored(values, "tiff"), invalid=(5.0,))

    assert values.tolist() == [[65535, -1, 5]]


@pytest.mark.parametrize("stored", ["int8", "int16", "int32", "float16", "float32", "float64"])
def test_numbers_that_are_stored_negative_become_pixels_of_the_documented_type(stored):
    pixels = "float64" if stored == "float64" else "float32"

    found = to_disparity(Stored(np.array([[-128, -5, 0, 7]], stored), "npy"), scale=-0.3).disparity

    assert found.dtype == pixels
    assert (found == np.array([[128, 5, 0, 0]], pixels) * np.array(0.3, pixels)).all()


@pytest.mark.parametrize("stored", ["uint16", "int16", "float32"])
def test_a_scale_beyond_what_pixels_hold_leaves_no_data(stored):
    assert (to_disparity(Stored(np.array([[0, 5]], stored), "npy"), scale=1e300).disparity == 0).all()


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
    forms = {"int16": values, "float32": values / np.float32(16), "uint16": values.astype(np.uint16) * 16}
    values = forms[form]

    found = to_disparity(Stored(values, "npy"))

    assert not found.disparity[~known].any()
    assert f"the smallest, {first - 1} px: they are taken as no data" in found.warnings["plateau"]
    assert " 1/m: they are" in to_disparity(Stored(values, "npy"), encoding="depth").warnings["plateau"]
    np.save(tmp_path / "map.npy", values)
    done = rollcli("estimate", "map.npy", cwd=tmp_path, status=0)
    assert float(rows_of(done.out)[0]["roll_deg"]) == pytest.approx(truth, abs=0.2)
    assert "taken as no data" in done.err


@needs_maps
@pytest.mark.parametrize("kind", ["network", "post", "raw", "refined", "sgm"])
def test_no_real_map_has_such_a_plateau(kind):
    files = sorted((REALMAPS / kind).glob("*.png"))
    assert files
    for file in files:
        assert "plateau" not in to_disparity(read_stored(file), scale=1.0).warnings, file
