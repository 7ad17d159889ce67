"""Heights over the road from the command line, against rendered truth and against the contract."""

import cv2
import numpy as np
import pytest
import tifffile

from rollcli.simulate.dataset import Dataset, write_dataset
from rollcli.simulate.spec import FrameSpec
from tests.run_cli import contents, road_map, rollcli, rows_of, write_kitti

RIG = ("--focal", "300", "--principal-point", "79.5,59.5", "--baseline", "0.5")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """Two rendered streets with their truth, maps and rows."""
    folder = tmp_path_factory.mktemp("rig")
    size = {"size": (621, 188), "focal": 360.0, "pitch": 0.06, "kerb": (0.1, 0.1), "dips": 3}
    specs = tuple(FrameSpec("street", roll, index=i, seed=8, **size) for i, roll in enumerate((0.1, -0.05)))
    assert len(list(write_dataset(Dataset(folder, specs)))) == 2
    line = ("estimate", "disparity", "--calib", "calib.txt", "-o", "rolls.csv", "--heights", "out")
    rollcli(*line, cwd=folder, status=0)
    return folder


def test_heights_of_true_maps_are_true(rendered):
    for name in ("frame_0001.tif", "frame_0002.tif"):
        heights, truth = (tifffile.imread(rendered / part / name) for part in ("out", "heights"))
        assert heights.dtype == np.float32
        known = np.isfinite(truth) & np.isfinite(heights)
        assert np.median(np.abs(heights - truth)[known]) < 0.002
        kerb = known & (np.abs(truth - 0.1) < 1e-4)
        assert np.median(heights[kerb]) == pytest.approx(0.1, abs=0.005)


def test_accuracy_compares_heights_where_truth_has_them(rendered):
    arguments = ("evaluate", "accuracy", "rolls.csv", "--truth", "truth.csv", "--format", "csv")
    (figures,) = rows_of(rollcli(*arguments, cwd=rendered, status=0).out)
    assert figures["over_road_at_5_m_frames"] == figures["over_road_at_10_m_frames"] == "2"
    depth_at = {}
    for name in ("frame_0001", "frame_0002"):
        heights, truth = (tifffile.imread(rendered / part / f"{name}.tif") for part in ("out", "heights"))
        disparity = cv2.imread(str(rendered / "disparity" / f"{name}.png"), cv2.IMREAD_UNCHANGED) / 256
        with np.errstate(divide="ignore"):
            depth = 360 * 0.54 / disparity
        for distance in (5, 10, 20):
            here = (depth > 0.8 * distance) & (depth < 1.2 * distance) & np.isfinite(heights - truth)
            depth_at.setdefault(distance, []).append((heights - truth)[here])
    for distance, parts in depth_at.items():
        expected = np.median(np.abs(np.concatenate(parts)))
        assert float(figures[f"over_road_at_{distance}_m_median_m"]) == pytest.approx(expected, abs=2e-6)
    table = rollcli(*arguments[:-2], cwd=rendered).out
    assert "heights, 10 m, median" in table
    (rendered / "none").mkdir()  # the same truth without heights
    (rendered / "none" / "truth.csv").write_bytes((rendered / "truth.csv").read_bytes())
    assert "heights" not in rollcli(*arguments[:-2], "--truth", "none/truth.csv", cwd=rendered).out


def test_heights_of_another_size_do_not_keep_accuracy_from_comparing_angles(tmp_path, rendered):
    """Views that were matched at half the size have heights of that size, unasked for."""
    pairs = ("--left", str(rendered / "left"), "--right", str(rendered / "right"), "--downscale", "2")
    more = ("--calib", str(rendered / "calib.txt"), "--heights", "half")
    assert rollcli("estimate", *pairs, *more, "-o", "rolls.csv", cwd=tmp_path).status == 0
    arguments = ("evaluate", "accuracy", "rolls.csv", "--truth", str(rendered / "truth.csv"))
    done = rollcli(*arguments, cwd=tmp_path)
    assert (done.status, done.out.startswith("frames compared")) == (0, True)
    assert "no heights are compared: half/frame_0001.tif" in done.err
    assert "differ in size" in done.err
    assert rollcli(*arguments, "--heights", "half", cwd=tmp_path).status == 2
    for path in (tmp_path / "half").iterdir():  # as `simulate --overwrite` without --dips leaves true ones
        path.unlink()
    assert "no heights are compared: half: no input found" in rollcli(*arguments, cwd=tmp_path).err


def description(path):
    with tifffile.TiffFile(path) as file:
        return file.pages[0].description


def test_the_unit_stands_in_the_file_and_npy_is_written_if_asked_for(tmp_path):
    write_kitti(tmp_path / "maps" / "day" / "a.png", road_map(0.1))
    run = ("estimate", "maps", "--recursive", "-o")
    assert rollcli(*run, "1.csv", "--heights", "h", "--heights-preview", "p", cwd=tmp_path).status == 0
    assert description(tmp_path / "h" / "day" / "a.tif") == "height over the road, camera heights"
    assert sorted(contents(tmp_path / "p")) == ["day/a.png"]
    assert rollcli(*run, "2.csv", "--heights", "m", *RIG, cwd=tmp_path).status == 0
    assert description(tmp_path / "m" / "day" / "a.tif") == "height over the road, metres"
    assert rollcli(*run, "3.csv", "--heights", "n", "--save-as=npy", *RIG[:4], cwd=tmp_path).status == 0
    both = np.load(tmp_path / "n" / "day" / "a.npy"), tifffile.imread(tmp_path / "h" / "day" / "a.tif")
    assert np.array_equal(*both, equal_nan=True)
    told = rollcli("heights", "maps/day", "--from", "3.csv", "-o", "again", cwd=tmp_path).err
    assert "was made with a calibration: give it with --calib" in told
    # below a road heights are negative, which no disparity is
    told = rollcli("derotate", "h/day", "--roll", "1", "-o", "turned", cwd=tmp_path, status=3).err
    assert "a.tif: holds heights over the road: give the disparity map" in told
