"""Stored numbers become pixels, and no data becomes 0, whatever a file calls it and a plateau shows."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError, UsageError
from rollcli.estimator.estimate import estimate_roll
from rollcli.files.encodings import Encoding, from_disparity, read_mask, to_disparity
from rollcli.files.formats import Stored, read_stored
from rollcli.rig.calibration import Calibration
from tests.binary_files import disparity_map, make_png, make_tiff
from tests.run_cli import rollcli, rows_of


def stored(values, dtype, **more):
    return Stored(np.array([values], dtype), "npy", **more)


def pixels(values, dtype, **options):
    return to_disparity(stored(values, dtype), **options).disparity[0].tolist()


@pytest.mark.parametrize(
    ("dtype", "encoding", "scale"),
    [
        ("u1", Encoding.PX, 1),
        ("u2", Encoding.KITTI, 1 / 256),
        ("i2", Encoding.SGBM, 1 / 16),
        ("i4", Encoding.PX, 1),
        ("u4", Encoding.PX, 1),
        ("f2", Encoding.PX, 1),
        ("f4", Encoding.PX, 1),
        ("f8", Encoding.PX, 1),
    ],
)
def test_auto_goes_by_the_type(dtype, encoding, scale):
    result = to_disparity(stored([0, 32, 64], dtype))

    assert result.encoding is encoding
    assert result.scale == scale
    assert result.disparity.dtype == (np.float64 if dtype == "f8" else np.float32)
    assert result.disparity.flags.c_contiguous
    assert result.disparity[0].tolist() == [0, 32 * scale, 64 * scale]


def test_each_encoding_reads_numbers_its_own_way():
    assert pixels([0, 1, 257, 512], "u2", encoding="kitti") == [0, 1 / 256, 257 / 256, 2]
    assert pixels([0, 1, 257, 513], "u2", encoding="cityscapes") == [0, 0, 1, 2]
    assert pixels([-16, 0, 16, 24], "i2", encoding="sgbm") == [0, 0, 1, 1.5]
    assert pixels([0, 1, 257], "u2", encoding="px") == [0, 1, 257]


def test_a_scale_stands_in_for_the_encoding():
    result = to_disparity(stored([0, 8], "u2"), scale=0.25)

    assert result.encoding is Encoding.PX
    assert result.disparity[0].tolist() == [0, 2]
    assert pixels([0, 9], "u2", encoding="cityscapes", scale=0.25) == [0, 2]


@pytest.mark.parametrize("scale", [0, float("nan"), float("inf")])
def test_a_scale_that_is_no_factor_is_refused(scale):
    with pytest.raises(UsageError, match="must be a number other than 0"):
        to_disparity(stored([1], "f4"), scale=scale)


def test_an_unknown_encoding_is_refused_with_those_there_are():
    with pytest.raises(UsageError, match="'middlebury' is unknown: choose one of auto, px, kitti"):
        to_disparity(stored([1], "f4"), encoding="middlebury")


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "g"])
@pytest.mark.parametrize("encoding", ["px", "kitti", "cityscapes", "sgbm"])
def test_nothing_that_is_no_number_is_left(dtype, encoding):
    values = np.array([np.nan, -np.inf, np.inf, -1, -0.0, 0, 32], dtype)

    result = pixels(values, dtype, encoding=encoding)

    assert result[:-1] == [0] * 6
    assert result[-1] > 0


def test_numbers_too_large_for_pixels_are_no_data():
    assert pixels([1e300], "f8", scale=1e20) == [0]
    assert pixels([np.longdouble("1e400")], "g") == [0]


def test_saturated_numbers_are_no_data():
    assert pixels([65534, 65535], "u2") == [65534 / 256, 0]
    assert pixels([32766, 32767], "i2") == [32766 / 16, 0]
    assert pixels([254, 255], "u1") == [254, 255]


def test_further_values_are_compared_as_they_are_stored():
    assert pixels([256, 512], "u2", invalid=(256.0,)) == [0, 2]
    assert pixels([0.5, 1.5], "f2", invalid=(1.5, 1e30)) == [0.5, 0]
    assert pixels([1, 2], "f4", invalid=(float("nan"), -1.0, float("inf"))) == [1, 2]


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


def test_storing_too_goes_by_the_type_and_knows_its_encodings():
    assert from_disparity(np.array([[2.0]]), "auto", "u2").tolist() == [[512]]
    assert from_disparity(np.array([[2.0]]), "auto", "i2").tolist() == [[32]]
    with pytest.raises(UsageError, match="'middlebury' is unknown"):
        from_disparity(np.array([[2.0]]), "middlebury")


def test_no_data_is_stored_as_each_encoding_has_it():
    empty = np.array([[0, -1, np.nan, np.inf, 2]])

    assert from_disparity(empty, "sgbm", "i2").tolist() == [[-16, -16, -16, -16, 32]]
    assert from_disparity(empty, "kitti").tolist() == [[0, 0, 0, 0, 512]]
    assert from_disparity(empty, "cityscapes").tolist() == [[0, 0, 0, 0, 513]]


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


@pytest.mark.parametrize(
    ("calibration", "expected"),
    [
        (None, [0.5, 0.25, 0]),
        (Calibration(fx=100, fy=100, cx=1, cy=0.5), [0.5, 0.25, 0]),  # a disparity of no rig known
        (Calibration(fx=100, fy=100, cx=1, cy=0.5, baseline=0.5), [25, 12.5, 0]),
        (Calibration(fx=100, fy=100, cx=1, cy=0.5, baseline=0.5, doffs=12.5), [12.5, 0, 0]),
    ],
)
def test_a_depth_becomes_the_disparity_of_the_rig_as_far_as_that_is_known(calibration, expected):
    assert pixels([2, 4, 0], "f4", encoding="depth", calibration=calibration) == expected


def test_stored_distances_are_metres_or_whole_millimetres():
    assert pixels([2, 4, 0, -4, np.inf, np.nan], "f8", encoding="depth") == [0.5, 0.25, 0, 0, 0, 0]
    for kind in ("u2", "i2", "u4", "i4"):
        assert pixels([2000, 4000, 0], kind, encoding="depth") == [0.5, 0.25, 0]
    assert pixels([512, 0], "u2", encoding="depth", scale=1 / 256) == [0.5, 0]
    assert pixels([500, 60000, 65535], "u2", encoding="depth", invalid=(60000,)) == [2, 0, 0]
    assert to_disparity(stored([500], "u2"), encoding="depth").scale == 1e-3
    assert pixels([1e-45, 2], "f4", encoding="depth") == [0, 0.5]  # 1/z is too large for a float32
    assert to_disparity(stored([2], "f8"), encoding="depth").disparity.dtype == np.float64
    assert to_disparity(stored([2], "f4"), encoding="depth").disparity.dtype == np.float32


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


def test_no_data_is_negative_in_signed_numbers_of_sgbm_alone():
    empty = np.array([[0.0, 2.0]])
    assert from_disparity(empty, "sgbm", "f4").tolist() == [[0, 32]]
    assert from_disparity(empty, "sgbm", "u2").tolist() == [[0, 32]]
    assert from_disparity(empty, "px", "i4").tolist() == [[0, 2]]
    assert from_disparity(np.array([[2.0]]), "kitti", "f4", scale=0.5).tolist() == [[4]]
    with pytest.raises(UsageError, match="a disparity is not written as a depth"):
        from_disparity(empty, "depth", "f4")


def test_disparities_are_rounded_to_the_nearest_number():
    assert from_disparity(np.array([[2.0019, 2.002]]), "kitti").tolist() == [[512, 513]]
    assert from_disparity(np.array([[2.5]]), "px", "f4").tolist() == [[2.5]]


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
