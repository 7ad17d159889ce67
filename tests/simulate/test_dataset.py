"""The folder that `rollcli simulate` writes, and the samples of the project."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from rollcli import __version__, read_calibration
from rollcli.errors import OutputError, UsageError
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_image
from rollcli.simulate import dataset as module
from rollcli.simulate.build import render_frame
from rollcli.simulate.dataset import plan_dataset, truth_csv, write_dataset
from rollcli.simulate.options import SimulateOptions
from tests.make_sample_data import EXACT, SAMPLES, SPECS, make
from tests.run_cli import contents, rows_of
from tests.true_disparity import true_disparity

TINY = SimulateOptions(frames=3, size=(64, 48), seed=9)


def simulate(folder, options=TINY, jobs=1, overwrite=False):
    return list(write_dataset(plan_dataset(folder, options, overwrite=overwrite), jobs))


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """A simulation that nobody changes."""
    folder = tmp_path_factory.mktemp("rendered")
    simulate(folder)
    return folder


@pytest.fixture
def rig(tmp_path, rendered):
    """A copy of it, which may be changed; nothing else is in its folder."""
    return shutil.copytree(rendered, tmp_path / "rig")


def rows(folder):
    return rows_of((folder / "truth.csv").read_text())


def test_the_folder_holds_left_right_disparity_and_truth(tmp_path):
    done = simulate(tmp_path / "rig")
    stems = ["frame_0001", "frame_0002", "frame_0003"]
    assert done == stems
    expected = {f"{part}/{stem}.png" for part in ("left", "right", "disparity") for stem in stems}
    assert set(contents(tmp_path / "rig")) == {*expected, "calib.txt", "truth.csv", "truth.csv.run.json"}
    specs = plan_dataset(tmp_path / "rig", TINY, overwrite=True).specs
    assert (tmp_path / "rig" / "truth.csv").read_bytes() == truth_csv(zip(stems, specs, strict=True))


def projections(path):
    lines = dict(line.split(": ") for line in path.read_text().splitlines())
    return [[float(number) for number in lines[name].split()] for name in ("P0", "P1")]


def test_frames_of_one_rig_share_a_calibration(tmp_path):
    simulate(tmp_path, SimulateOptions(frames=2, size=(64, 48), principal_point=(30.0, 25.5), baseline=0.25))
    left, right = projections(tmp_path / "calib.txt")
    assert left == [37.12, 0, 30, 0, 0, 37.12, 25.5, 0, 0, 0, 1, 0]
    assert right == [37.12, 0, 30, -9.28, 0, 37.12, 25.5, 0, 0, 0, 1, 0]
    assert not (tmp_path / "calib").exists()
    read = read_calibration(tmp_path / "calib.txt")
    assert (read.fx, read.fy, read.cx, read.cy) == (37.12, 37.12, 30.0, 25.5)
    assert (read.baseline, read.doffs) == (pytest.approx(0.25), 0.0)
    assert read.notes == ()


def test_frames_of_different_rigs_have_a_calibration_each(tmp_path):
    asked = SimulateOptions(frames=3, size=(64, 48), principal_offset=(-6, 6), height=(1.3, 1.8))
    simulate(tmp_path, asked)
    assert not (tmp_path / "calib.txt").exists()
    assert len({row["cx_px"] for row in rows(tmp_path)} | {row["cy_px"] for row in rows(tmp_path)}) == 6
    assert len({row["height_m"] for row in rows(tmp_path)}) == 3
    for row in rows(tmp_path):
        left, _ = projections(tmp_path / "calib" / f"{row['file']}.txt")
        assert (left[2], left[6]) == pytest.approx((float(row["cx_px"]), float(row["cy_px"])), abs=1e-7)
        assert 25.5 <= left[2] <= 37.5
        assert 17.5 <= left[6] <= 29.5
        assert 1.3 <= float(row["height_m"]) <= 1.8


def test_overwriting_leaves_no_calibration_of_an_earlier_rig(tmp_path):
    simulate(tmp_path, SimulateOptions(frames=2, size=(64, 48), principal_offset=(-6, 6)))
    simulate(tmp_path, SimulateOptions(frames=1, size=(64, 48)), overwrite=True)
    assert not list((tmp_path / "calib").iterdir())
    simulate(tmp_path, SimulateOptions(frames=2, size=(64, 48), principal_offset=(-6, 6)), overwrite=True)
    assert not (tmp_path / "calib.txt").exists()


@pytest.mark.parametrize("roll_deg", [-30, 0, 12])
def test_the_nearest_disparity_is_that_of_the_corner_of_the_image_nearest_to_the_road(tmp_path, roll_deg):
    asked = SimulateOptions(
        frames=1, scene="bare", size=(64, 48), roll_deg=(roll_deg, roll_deg), principal_point=(25.0, 20.0)
    )
    dataset = plan_dataset(tmp_path, asked)
    assert dataset.nearest_disparity == pytest.approx(true_disparity(dataset.specs[0])[0].max(), abs=1e-9)


def test_images_are_the_rendered_frame(rig):
    specs = plan_dataset(rig / "x", TINY).specs
    for stem, spec in (("frame_0001", specs[0]), ("frame_0003", specs[2])):
        frame = render_frame(spec)
        for part, image in (("left", frame.left), ("right", frame.right)):
            data = np.frombuffer((rig / part / f"{stem}.png").read_bytes(), np.uint8)
            assert np.array_equal(cv2.imdecode(data, cv2.IMREAD_UNCHANGED), image)
        stored = read_disparity(rig / "disparity" / f"{stem}.png")
        assert np.array_equal(stored > 0, frame.disparity > 0)
        assert np.abs(stored - frame.disparity).max() <= 1 / 512 + 1e-6 or stored.min() == 1 / 256


def test_the_files_are_the_same_whatever_the_jobs_are(tmp_path, rendered):
    simulate(tmp_path / "two", jobs=2)
    assert contents(rendered) == contents(tmp_path / "two")


def test_overwriting_leaves_no_frame_of_an_earlier_simulation_and_no_other_file_is_touched(rig):
    for name in ("mine.png", "frame_0099.png"):
        (rig / "left" / name).write_bytes(b"mine")
    simulate(rig, SimulateOptions(frames=1, size=(64, 48)), overwrite=True)
    left = sorted(path.name for path in (rig / "left").iterdir())
    assert left == ["frame_0001.png", "frame_0099.png", "mine.png"]
    assert len(rows(rig)) == 1


def test_disparities_beyond_what_the_file_can_hold_are_no_data(tmp_path):
    # the road gains half a pixel of disparity a row, and passes the largest that fits
    options = SimulateOptions(
        frames=1,
        scene="bare",
        size=(16, 1200),
        focal=100,
        baseline=0.5,
        height=(1, 1),
        roll_deg=(0, 0),
        pitch_deg=(5, 5),
    )
    simulate(tmp_path, options)
    (spec,) = plan_dataset(tmp_path, options, overwrite=True).specs
    stored, disparity = read_disparity(tmp_path / "disparity/frame_0001.png"), render_frame(spec).disparity
    assert disparity.max() > 256
    assert stored.max() > 255
    assert np.array_equal(stored == 0, (disparity > 65534 / 256) | (disparity == 0))


def test_truth_appears_only_when_every_frame_is_there(tmp_path, monkeypatch):
    def fail_at_second(spec):
        if spec.index == 1:
            raise OutputError("disk full")
        return render_frame(spec)

    monkeypatch.setattr(module, "render_frame", fail_at_second)
    with pytest.raises(OutputError):
        simulate(tmp_path)
    images = {f"{part}/frame_0001.png" for part in ("left", "right", "disparity")}
    assert set(contents(tmp_path)) == {*images, "truth.csv.run.json"}


def test_a_resumed_simulation_keeps_whole_frames_and_ends_with_the_same_bytes(rig, rendered):
    kept, half, missing = (f"frame_000{number}.png" for number in (1, 2, 3))
    (rig / "disparity" / half).unlink()
    for part in ("left", "right", "disparity"):
        (rig / part / missing).unlink()
    for name in ("truth.csv", "calib.txt"):
        (rig / name).unlink()
    before = (rig / "left" / kept).stat().st_mtime_ns
    assert simulate(rig, replace(TINY, resume=True)) == ["frame_0002", "frame_0003"]
    assert (rig / "left" / kept).stat().st_mtime_ns == before
    assert contents(rig) == contents(rendered)


def test_resuming_what_was_never_begun_begins_it(tmp_path):
    assert len(simulate(tmp_path / "rig", replace(TINY, resume=True))) == 3


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"seed": 10}, "--seed was 9, is now 10"),
        ({"roll_deg": (-5.0, 5.0)}, r"--roll was \[-10.0, 10.0\], is now \[-5.0, 5.0\]"),
        ({"frames": 4}, "--frames was 3, is now 4"),
        ({"focal": 50.0}, "--focal was not given, is now 50"),
    ],
)
def test_a_simulation_with_other_options_is_not_resumed(rig, changed, said):
    with pytest.raises(UsageError, match=said):
        plan_dataset(rig, replace(TINY, resume=True, **changed))


def test_a_simulation_of_another_version_is_not_resumed(rig):
    record = rig / "truth.csv.run.json"
    record.write_text(record.read_text().replace(f'"rollcli": "{__version__}"', '"rollcli": "0.0.1"'))
    with pytest.raises(UsageError, match=r"begun by rollcli 0\.0\.1"):
        plan_dataset(rig, replace(TINY, resume=True))


@pytest.mark.parametrize("record", ["not json", "[]", "{}", '{"rollcli": "1", "options": []}'])
def test_a_damaged_record_is_not_resumed(rig, record):
    (rig / "truth.csv.run.json").write_text(record)
    with pytest.raises(UsageError, match=r"truth\.csv\.run\.json is damaged"):
        plan_dataset(rig, replace(TINY, resume=True))


@pytest.mark.parametrize(
    ("there", "resume", "overwrite", "said"),
    [
        ("rig/notes.txt", False, False, "--overwrite"),
        ("rig/notes.txt", True, False, r"there is no truth\.csv\.run\.json"),
        ("rig/notes.txt", True, True, "either --resume or --overwrite"),
        ("rig", False, True, "not a folder"),
    ],
)
def test_what_is_in_the_folders_place_is_not_written_over(tmp_path, there, resume, overwrite, said):
    (tmp_path / there).parent.mkdir(exist_ok=True)
    (tmp_path / there).write_text("mine")
    with pytest.raises(UsageError, match=said):
        plan_dataset(tmp_path / "rig", replace(TINY, resume=resume), overwrite=overwrite)


STEMS = [f"frame_{number:04d}" for number in range(1, len(SPECS) + 1)]


def files(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    make(folder)
    return folder


@pytest.mark.slow
def test_the_script_makes_the_same_files_and_the_same_truth(made):
    assert files(SAMPLES) == files(made)
    assert (SAMPLES / "truth.csv").read_text() == (made / "truth.csv").read_text()


@pytest.mark.slow
def test_the_script_makes_the_same_pictures(made):
    # other versions compress in other ways, and other processors may round a grey level to its neighbour
    for name in (f"{side}/{stem}.png" for side in ("left", "right") for stem in STEMS):
        difference = np.abs(read_image(SAMPLES / name).astype(float) - read_image(made / name))
        assert np.mean(difference > 1) < 1e-4


@pytest.mark.parametrize(("stem", "spec"), list(zip(STEMS, SPECS, strict=True)))
def test_each_map_shows_its_scene_with_the_roll_that_truth_says(stem, spec):
    found = {row["file"]: row for row in rows(SAMPLES)}
    assert float(found[stem]["roll_deg"]) == pytest.approx(math.degrees(spec.roll))
    (path,) = (SAMPLES / "maps").glob(f"{stem}.*")
    found, (disparity, road) = read_disparity(path), true_disparity(spec)
    both = road & (found > 0)
    assert both.sum() > 0.6 * road.sum()
    error = np.abs(found - disparity)[both]
    assert error.max() <= 1 / 256 if stem == EXACT else np.median(error) < 0.3


def test_the_samples_are_small():
    assert sum(path.stat().st_size for path in SAMPLES.rglob("*")) < 3e6
