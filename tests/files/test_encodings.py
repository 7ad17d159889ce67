"""Stored numbers become pixels, and no data becomes 0, whatever a file calls it and a plateau shows."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import from_disparity, read_mask, to_disparity
from rollcli.files.formats import Stored, read_stored
from tests.binary_files import disparity_map, make_png, make_tiff
from tests.run_cli import rollcli, rows_of


def stored(values, dtype, **more):
    return Stored(np.array([values], dtype), "npy", **more)


def pixels(values, dtype, **options):
    return to_disparity(stored(values, dtype), **options).disparity[0].tolist()


def test_numbers_too_large_for_pixels_are_no_data():
    assert pixels([1e300], "f8", scale=1e20) == [0]
    assert pixels([np.longdouble("1e400")], "g") == [0]


def test_the_value_that_the_file_calls_no_data_is_no_data():
    values = stored([1, 9999], "f4", nodata=(9999.0,))

    assert to_disparity(values).disparity[0].tolist() == [1, 0]


def test_whole_pixels_read_as_kitti_are_doubted_under_auto_alone():
    few = stored([0, 511], "u2")

    assert "--encoding px" in to_disparity(few).warning
    assert to_disparity(few, encoding="kitti").warning is None
    assert to_disparity(few, scale=1.0).warning is None
    assert to_disparity(stored([0, 512], "u2")).warning is None
    assert to_disparity(stored([0, 0], "u2")).warning is None


def test_a_note_of_the_file_reaches_the_user():
    assert to_disparity(stored([1], "f4", note="two pages")).warning == "two pages"


def test_the_stored_numbers_are_left_alone():
    values = np.array([[65535, -1, 5]], np.float32)
    values.flags.writeable = False

    to_disparity(Stored(values, "tiff"), invalid=(5.0,))

    assert values.tolist() == [[65535, -1, 5]]


@pytest.mark.parametrize(
    ("encoding", "dtype"),
    [("kitti", "u2"), ("cityscapes", "u2"), ("sgbm", "i2"), ("px", "f4"), ("px", "f8"), ("px", "f2")],
)
def test_pixels_survive_the_way_there_and_back(encoding, dtype):
    disparity = np.abs(disparity_map())

    numbers = from_disparity(disparity, encoding, dtype)
    again = to_disparity(Stored(numbers, "npy"), encoding=encoding).disparity

    assert numbers.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(again > 0, disparity > 0)
    np.testing.assert_allclose(again, disparity, atol=1 / 30)


def test_masks_of_maps_and_images_are_read(tmp_path):
    mask = np.eye(4, dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(make_png(mask, 8))
    (tmp_path / "b.tif").write_bytes(make_tiff(mask.astype(np.float32)))
    (tmp_path / "c.bmp").write_bytes(cv2.imencode(".bmp", mask * 255)[1].tobytes())
    (tmp_path / "d.pgm").write_bytes(cv2.imencode(".pgm", mask)[1].tobytes())
    (tmp_path / "e.jpg").write_bytes(cv2.imencode(".jpg", mask)[1].tobytes())

    for name in ("a.png", "b.tif", "c.bmp", "d.pgm"):
        assert read_mask(tmp_path / name).tolist() == mask.astype(bool).tolist()
    with pytest.raises(InputError, match="is a JPEG image"):  # its zeros are not all zero
        read_mask(tmp_path / "e.jpg")


def test_one_pixel_of_a_hundred_may_be_too_large_and_no_more():
    disparity = np.full((10, 10), 100.0)
    disparity[0, 0] = 65535 / 256
    assert from_disparity(disparity, "kitti")[0].tolist() == [0, *[25600] * 9]
    disparity[0, 1:3] = 0  # 98 are valid: one is more than a hundredth of them
    with pytest.raises(
        InputError, match=r"^disparities up to 256 px do not fit numbers that end at 256 px: give"
    ):
        from_disparity(disparity, "kitti")
    assert from_disparity(np.array([[65534 / 256]]), "kitti").tolist() == [[65534]]


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
    assert float(rows_of(done.out)[0]["roll_deg"]) == pytest.approx(truth, abs=0.2)
    assert "taken as no data" in done.err


def test_a_largest_number_that_stands_for_all_beyond_it_is_no_data():
    rows = np.arange(200, dtype=np.float32)[:, None]
    values = np.minimum(rows * 2.0 + 3 + np.linspace(0, 1, 300, dtype=np.float32), 255).astype(np.float32)

    found = to_disparity(Stored(values, "npy"))

    assert (found.disparity[:125] > 0).all()
    assert not found.disparity[127:].any()
    assert abs(np.degrees(estimate_roll(found.disparity).theta)) < 0.2


@pytest.mark.skipif(not REALMAPS.is_dir(), reason="needs the real maps beside the project")
@pytest.mark.parametrize("kind", ["network", "post", "raw", "refined", "sgm"])
def test_no_real_map_has_such_a_plateau(kind):
    files = sorted((REALMAPS / kind).glob("*.png"))
    assert files
    for file in files:
        assert "taken as no data" not in (to_disparity(read_stored(file), scale=1.0).warning or ""), file
