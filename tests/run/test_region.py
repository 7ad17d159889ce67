"""The pixels that --roi, --polygon and --mask allow."""

import zipfile

import cv2
import numpy as np
import pytest

from rollcli.estimator.moments import usable_of
from rollcli.estimator.request import Request
from rollcli.run.options import FramesOptions, RegionOptions
from rollcli.run.read import region_mask, road_finder
from tests.run_cli import rollcli, write_kitti, write_maps

SHAPE = (120, 160)
V, U = np.mgrid[: SHAPE[0], : SHAPE[1]]


def allowed(*corners):
    """The pixels inside a polygon."""
    options = FramesOptions(region=RegionOptions(polygon=tuple(corners)))
    return region_mask(None, options, SHAPE)


@pytest.mark.parametrize("far", [1e4, 1e6])
def test_a_polygon_may_reach_far_out_of_the_map(far):
    assert allowed((-far, -far), (far, -far), (far, far), (-far, far)).all()
    np.testing.assert_array_equal(allowed((80, -far), (far, -far), (far, far), (80, far)), U >= 80)
    np.testing.assert_array_equal(allowed((-far, 60), (far, 60), (far, far), (-far, far)), V >= 60)


@pytest.mark.parametrize("far", [1e4, 1e6])
def test_a_slanted_side_that_reaches_far_keeps_its_place(far):
    found = allowed((-far, -far), (far, far), (-far, far))

    assert found[V > U].all()
    assert not found[V < U].any()
    np.testing.assert_array_equal(allowed((0, 0), (far, 0), (far, far)), V <= U)


def test_of_a_pair_the_road_is_found_in_the_region():
    options = FramesOptions(region=RegionOptions(roi=(81, 30, 160, 100)))
    find_road = road_finder(region_mask(None, options, SHAPE), Request())
    v, u = np.mgrid[:60, :80]
    left, right = 10 + 0.5 * v - 0.1 * u, 12 + 0.4 * v + 0.05 * u
    small = np.where(u < 41, left, right)
    assert find_road(small, 1) == pytest.approx((12, 0.05, 0.4), abs=1e-3)
    small[v < 15] = small[v >= 50] = 0  # nothing in the region is no data
    assert find_road(small, 1) == pytest.approx((12, 0.05, 0.4), abs=1e-3)
    assert find_road(np.where(u < 41, left, 0), 1) is None


def test_masks_in_an_archive_are_those_of_a_folder(tmp_path):
    write_maps(tmp_path / "maps", 2)
    with zipfile.ZipFile(tmp_path / "masks.zip", "w") as archive:
        for number, place in enumerate((20, -20)):
            path = tmp_path / "masks" / f"frame{number}.png"
            write_kitti(path, np.eye(*SHAPE, place) + np.eye(*SHAPE, place // 2))
            archive.writestr(f"./{path.name}", path.read_bytes())  # as libarchive has it
    one, each, packed = (
        rollcli("estimate", "maps", "--road", "all", "-q", "--mask", mask, cwd=tmp_path).out
        for mask in ("masks.zip#./frame1.png", "masks", "masks.zip")
    )
    assert packed == each
    assert one.splitlines()[1] != each.splitlines()[1]
    assert one.splitlines()[2] == each.splitlines()[2]


def test_what_is_no_number_in_a_mask_is_not_used(tmp_path):
    values = np.where(V > 30, -1.0, np.where(V > 10, np.nan, 0))
    np.save(tmp_path / "mask.npy", values)
    found = region_mask(str(tmp_path / "mask.npy"), FramesOptions(), SHAPE)
    np.testing.assert_array_equal(found, V > 30)
    np.testing.assert_array_equal(usable_of(values), V > 30)


def test_a_mask_below_a_url_is_read_anew_by_each_run(monkeypatch):
    for run, mask in (("first", V > 30), ("second", V > 50)):
        data = cv2.imencode(".png", np.uint8(mask))[1].tobytes()
        monkeypatch.setattr("rollcli.run.read.read_bytes", lambda *_, data=data: data)
        np.testing.assert_array_equal(region_mask("s3://maps/m.png", FramesOptions(run=run), SHAPE), mask)


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_transparent_pixels_of_a_mask_are_not_used(tmp_path, depth):
    shown = np.where(V > 60, np.iinfo(depth).max, 0).astype(depth)
    cv2.imwrite(str(tmp_path / "mask.png"), np.dstack([np.full((*SHAPE, 3), 255, depth), shown]))
    found = region_mask(str(tmp_path / "mask.png"), FramesOptions(), SHAPE)
    np.testing.assert_array_equal(found, V > 60)
