"""The folder that `rollcli simulate` writes, the samples of the project, and which rigs can be drawn."""

import math

import numpy as np
import pytest

from rollcli.errors import OutputError, UsageError
from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_image
from rollcli.simulate import dataset as module
from rollcli.simulate.build import render_frame
from rollcli.simulate.dataset import plan_dataset, write_dataset
from rollcli.simulate.options import CROSSFALL, FOCAL_PER_WIDTH, GUTTER_WIDTH, KERB, SCENES, SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
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


@pytest.mark.parametrize("roll_deg", [-30, 0, 12])
def test_the_nearest_disparity_is_that_of_the_corner_of_the_image_nearest_to_the_road(roll_deg):
    asked = SimulateOptions(
        frames=1, scene="bare", size=(64, 48), roll_deg=(roll_deg, roll_deg), principal_point=(25.0, 20.0)
    )
    (spec,) = draw_specs(asked)
    assert spec.nearest_disparity == pytest.approx(true_disparity(spec)[0].max(), abs=1e-9)


def test_the_files_are_the_same_whatever_the_jobs_are(tmp_path, rendered):
    simulate(tmp_path / "two", jobs=2)
    assert contents(rendered) == contents(tmp_path / "two")


def test_disparities_beyond_what_the_file_can_hold_are_no_data(tmp_path):
    # the road gains half a pixel of disparity a row, and passes the largest that fits
    rig = {"focal": 100, "baseline": 0.5, "height": (1, 1), "roll_deg": (0, 0), "pitch_deg": (5, 5)}
    options = SimulateOptions(frames=1, scene="bare", size=(16, 1200), **rig)
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


STEMS = [f"frame_{number:04d}" for number in range(1, len(SPECS) + 1)]


@pytest.mark.slow
def test_the_script_makes_the_same_files_and_the_same_truth(tmp_path):
    make(tmp_path)
    assert contents(SAMPLES).keys() == contents(tmp_path).keys()
    assert (SAMPLES / "truth.csv").read_text() == (tmp_path / "truth.csv").read_text()
    # other versions compress in other ways, and other processors may round a grey level to its neighbour
    for name in (f"{side}/{stem}.png" for side in ("left", "right") for stem in STEMS):
        difference = np.abs(read_image(SAMPLES / name).astype(float) - read_image(tmp_path / name))
        assert np.mean(difference > 1) < 1e-4


@pytest.mark.parametrize(("stem", "spec"), list(zip(STEMS, SPECS, strict=True)))
def test_each_map_shows_its_scene_with_the_roll_that_truth_says(stem, spec):
    found = {row["file"]: row for row in rows_of((SAMPLES / "truth.csv").read_text())}
    assert float(found[stem]["roll_deg"]) == pytest.approx(math.degrees(spec.roll))
    (path,) = (SAMPLES / "maps").glob(f"{stem}.*")
    found, (disparity, road) = read_disparity(path), true_disparity(spec)
    both = road & (found > 0)
    assert both.sum() > 0.6 * road.sum()
    error = np.abs(found - disparity)[both]
    assert error.max() <= 1 / 256 if stem == EXACT else np.median(error) < 0.3


def test_the_samples_are_small():
    assert sum(path.stat().st_size for path in SAMPLES.rglob("*")) < 3e6


@pytest.mark.parametrize("pitch_deg", [0, 30])
def test_the_right_camera_is_above_the_road_just_when_the_baseline_leaves_room(pitch_deg):
    pitch = math.radians(pitch_deg)
    lowest = 0.54 * math.sin(math.radians(40)) * math.cos(pitch)
    FrameSpec(roll=-math.radians(40), pitch=pitch, height=lowest + 1e-6)
    FrameSpec(roll=math.radians(40), pitch=pitch, height=1e-6)
    with pytest.raises(UsageError, match="right camera is under the road"):
        FrameSpec(roll=-math.radians(40), pitch=pitch, height=lowest - 1e-6)
    # the pitch that is nearest to level leaves the least room, whatever would be drawn
    poses = {"frames": 0, "roll_deg": (-40.0, 0.0), "pitch_deg": (-60.0, -float(pitch_deg))}
    draw_specs(SimulateOptions(height=(lowest + 1e-6, 2.0), **poses))
    with pytest.raises(UsageError, match="right camera is under the road"):
        draw_specs(SimulateOptions(height=(lowest - 1e-6, 2.0), **poses))


def test_the_help_has_the_numbers_that_are_used():
    ranges = [f"[default: {low:g}:{high:g}]" for low, high in (CROSSFALL, KERB)]
    said = " ".join(str(SimulateOptions.__doc__).split())
    for each in (*ranges, f"{FOCAL_PER_WIDTH:g} times the width", f"outer {100 * GUTTER_WIDTH:g} cm"):
        assert each in said


def test_without_ranges_the_documented_ones_are_drawn():
    specs = draw_specs(SimulateOptions(frames=3000, seed=8, cross_section="crown"))
    for values, low, high in (
        (np.degrees([spec.roll for spec in specs]), -10, 10),
        (np.degrees([spec.pitch for spec in specs]), -2, 6),
        ([100 * spec.crossfall for spec in specs], 1, 4),
        ([spec.curvature for spec in specs if spec.curvature], -0.001, 0.001),
    ):
        span = high - low
        assert low <= min(values) < low + 0.01 * span
        assert high - 0.01 * span < max(values) <= high
    rigs = {(s.height, s.baseline, s.focal, s.noise, s.size, s.kerb, s.gutter, s.centre) for s in specs}
    assert rigs == {(1.65, 0.54, 371.2, 1.5, (640, 480), (0.1, 0.2), 0.0, (319.5, 239.5))}


def test_mixed_draws_every_scene_and_only_a_bare_road_is_always_flat():
    specs = draw_specs(SimulateOptions(frames=400, seed=2))
    flat = {kind: np.mean([s.curvature == 0 for s in specs if s.scene == kind]) for kind in SCENES}
    assert flat.pop("bare") == 1
    assert all(0.3 < share < 0.7 for share in flat.values())
