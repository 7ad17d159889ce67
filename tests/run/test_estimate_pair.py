"""A pair, its map and the call in Python say the same."""

import json
import math

import numpy as np
import pytest

import rollcli as package
from rollcli.files.codecs.arrays import Stored
from rollcli.files.results import ALIGNMENT_COLUMNS
from rollcli.rig.calibration import Calibration
from rollcli.run.read import Source, _carried
from rollcli.simulate import dataset
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs
from tests.odd_views import seen_by, seen_rolled, seen_turned
from tests.run_cli import rollcli, rows_of, write_views

VIEWS = ("--left", "left", "--right", "right")


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A pair in files, whose right view is 0.4 % larger and 1 px lower; its calibration beside it."""
    folder = tmp_path_factory.mktemp("pair")
    spec = FrameSpec(scene="open", roll=math.radians(3), seed=12, colour=False)
    frame = render_frame(spec)
    right = seen_by(frame.right, larger_percent=0.4, lower=1)
    write_views(folder, "a.png", frame.left, right)
    (folder / "calib.txt").write_bytes(dataset.calibration(spec))
    return folder, frame.left, right


def row_of(folder, *inputs, calib=("--calib", "calib.txt")):
    rollcli("estimate", *inputs, *calib, "-o", "rolls.csv", "--overwrite", cwd=folder, status=0)
    return rows_of((folder / "rolls.csv").read_text())[0]


def rows_of_pair_and_map(folder, *given, form="png", axis=(), **how):
    """The row of the pair as it is asked for, and that of the map that `disparity` makes of it."""
    line = ("disparity", *VIEWS, *given, *axis, "-o", form, "--overwrite", "--save-as", form)
    rollcli(*line, cwd=folder, status=0)
    return [row_of(folder, *inputs, *axis, **how) for inputs in ((*VIEWS, *given), (form,))]


def test_views_of_a_rig_that_hung_are_told(pair, tmp_path):
    """Its left camera saw from the right, and all upside down."""
    hung = pair[2][::-1, ::-1], pair[1][::-1, ::-1]
    write_views(tmp_path, "a.png", *hung)
    told = row_of(tmp_path, *VIEWS, calib=())["message"]
    assert told.startswith(
        "looks upside down, as from a rig that hung: turn both views by half a turn, and swap"
    )
    assert package.estimate_pair(*hung).message == told


@pytest.mark.parametrize("form", ["png", "tiff"])
def test_a_pair_and_its_map_give_the_same_row(pair, form):
    of_pair, of_map = rows_of_pair_and_map(pair[0], form=form)

    assert float(of_pair["roll_ci95_deg"]) > 0.03  # of which levelling is the most
    assert of_map["message"] == of_pair["message"]
    assert [of_map[name] for name in ALIGNMENT_COLUMNS] == [of_pair[name] for name in ALIGNMENT_COLUMNS]
    assert float(of_map["right_larger_percent"]) > 0.05
    assert of_map["status"] == of_pair["status"]
    for column in ("roll_deg", "roll_ci95_deg", "pitch_deg", "height_m"):
        assert float(of_map[column]) == pytest.approx(float(of_pair[column]), abs=0.01)


@pytest.mark.slow
def test_a_yaw_is_about_the_principal_point_in_a_pair_and_in_its_map(tmp_path):
    """Views without their right fifth: a yaw about the middle would turn the road by 0.1 degrees."""
    spec = FrameSpec(scene="open", roll=math.radians(3), seed=12, colour=False, size=(800, 600))
    frame = render_frame(spec)
    right = seen_turned(frame.right, yaw_deg=0.3)
    write_views(tmp_path, "a.png", frame.left[60:540, :640], right[60:540, :640])
    axis = ("--focal", str(spec.focal), "--principal-point", "399.5,239.5")

    of_pair, of_map = rows_of_pair_and_map(tmp_path, form="tiff", axis=axis, calib=())

    assert float(of_pair["roll_deg"]) == pytest.approx(3, abs=0.06)
    assert float(of_map["roll_deg"]) == pytest.approx(float(of_pair["roll_deg"]), abs=0.01)


@pytest.mark.parametrize(("form", "downscale"), [("png", "2"), ("tiff", "1.3")])
def test_a_map_of_shrunk_views_has_the_pose_of_its_pair(pair, form, downscale):
    """The calibration states no size: that of the images is in the file of the map."""
    of_pair, of_map = rows_of_pair_and_map(pair[0], "--downscale", downscale, form=form)
    assert float(of_map["height_m"]) == pytest.approx(float(of_pair["height_m"]), rel=1e-3)
    for value, half in (("roll_deg", "roll_ci95_deg"), ("pitch_deg", "pitch_ci95_deg")):
        assert abs(float(of_map[value]) - float(of_pair[value])) < float(of_pair[half]) / 2


def test_a_map_that_is_turned_upright_keeps_what_levelling_left_open(pair):
    folder, _, _ = pair
    of_pair = row_of(folder, *VIEWS, "--derotated", "upright")
    assert rollcli("disparity", *VIEWS, "-o", "maps", cwd=folder).status == 0
    assert rollcli("derotate", "maps", "--roll", of_pair["roll_deg"], "-o", "turned", cwd=folder).status == 0

    for turned in ("upright", "turned"):
        row = row_of(folder, turned)
        assert float(row["roll_deg"]) == pytest.approx(0, abs=0.02)
        assert float(row["roll_ci95_deg"]) == pytest.approx(float(of_pair["roll_ci95_deg"]), abs=0.01)
        assert [row[name] for name in ALIGNMENT_COLUMNS] == [of_pair[name] for name in ALIGNMENT_COLUMNS]


@pytest.mark.slow
@pytest.mark.parametrize(("percent", "share"), [(0.0, 0.95), (0.5, 0.8)])
def test_where_the_right_camera_is_rolled_or_longer_the_interval_holds_the_pitch(percent, share):
    """The principal point lies 30 px off the middle: levelling moves all disparities by 0.16 px or 0.15."""
    rig = {"pitch_deg": (2.0, 7.0), "curvature": (0.0, 0.0), "grey": True, "frames": 6, "seed": 52}
    held, off = [], []
    for sign in (-1, 1):
        centre = (319.5 - 30 * sign, 239.5) if percent else (319.5, 239.5 + 30 * sign)
        for spec in draw_specs(SimulateOptions(principal_point=centre, **rig)):
            calibration = Calibration(spec.focal, spec.focal, *spec.centre, spec.baseline)
            right = seen_rolled(spec, 0.0 if percent else -0.3 * sign, percent)
            found = package.estimate_pair(render_frame(spec).left, right, calibration=calibration)
            off.append(math.degrees(abs(found.pitch - spec.pitch)))
            held.append(math.radians(off[-1]) <= found.pitch_ci95)
    assert np.mean(held) >= share - 3 * math.sqrt(share * (1 - share) / len(held))
    assert np.median(off) < 0.02


@pytest.mark.slow
def test_a_map_of_a_pair_whose_right_camera_is_rolled_has_the_pitch_of_its_pair(tmp_path):
    spec = FrameSpec(scene="open", pitch=0.07, principal_point=(319.5, 200.0), seed=12, colour=False)
    write_views(tmp_path, "a.png", render_frame(spec).left, seen_rolled(spec, 0.5))
    (tmp_path / "calib.txt").write_bytes(dataset.calibration(spec))
    of_pair, of_map = rows_of_pair_and_map(tmp_path)

    assert float(of_pair["pitch_deg"]) == pytest.approx(math.degrees(spec.pitch), abs=0.03)
    assert float(of_map["pitch_deg"]) == pytest.approx(float(of_pair["pitch_deg"]), abs=0.005)


@pytest.mark.slow
def test_a_right_camera_that_is_rolled_turns_no_road_where_pixels_are_not_square():
    spec = FrameSpec("open", roll=0.2, pitch=0.07, principal_point=(319.5, 200.0), seed=12, colour=False)
    views = (each[::2] for each in (render_frame(spec).left, seen_rolled(spec, 1.0)))
    calibration = Calibration(spec.focal, spec.focal / 2, 319.5, 100.0, spec.baseline)
    found = package.estimate_pair(*views, calibration=calibration)
    pose = spec.roll, spec.pitch, spec.height
    assert (found.theta, found.pitch, found.height_m) == pytest.approx(pose, abs=0.002)


def test_a_pair_that_was_measured_and_not_levelled_has_the_calibration_as_it_is():
    calibration = Calibration(300.0, 300.0, 160.0, 60.0, 0.5, 1.5)
    known = {"disparity": np.ones((240, 320)), "alignment": {"right_clockwise_deg": 0.01}}
    assert Source(**known).calibrated(calibration).doffs == 1.5
    levelled = 1.5 + 2e-4 * (60 - 119.5) - 0.004 * (161.5 - 159.5)  # about the right view's principal point
    assert Source(**known, levelled=(0.004, 2e-4)).calibrated(calibration).doffs == pytest.approx(levelled)
    assert Source(**known).calibrated(None) is None


def test_the_call_says_what_the_command_does(pair):
    folder, left, right = pair
    row = row_of(folder, *VIEWS)

    found = package.estimate_pair(left, right, calibration=package.read_calibration(folder / "calib.txt"))

    assert math.degrees(found.theta) == pytest.approx(float(row["roll_deg"]), abs=1e-5)
    assert math.degrees(found.ci95) == pytest.approx(float(row["roll_ci95_deg"]), abs=1e-5)
    assert math.degrees(found.pitch) == pytest.approx(float(row["pitch_deg"]), abs=1e-5)
    assert found.height_m == pytest.approx(float(row["height_m"]), abs=1e-5)
    assert (found.status, found.message) == (row["status"], row["message"])


def test_the_row_says_where_no_road_was_matched_along_its_plane(pair, tmp_path):
    _, *views = pair
    height, width = views[0].shape
    board = np.random.default_rng(0).integers(0, 256, (2 * height // 5, width - 140), dtype=np.uint8)
    hidden = [view.copy() for view in views]
    for view, first in zip(hidden, (100, 40), strict=True):  # nearer than most of the road
        view[-len(board) :, first : first + board.shape[1]] = board
    write_views(tmp_path, "road.png", *views)
    write_views(tmp_path, "hidden.png", *hidden)
    rows = rows_of(rollcli("estimate", *VIEWS, cwd=tmp_path).out)
    says = "matched over the whole range, as too little road was found to match along"
    assert [says in row["message"] for row in rows] == [True, False]


def test_an_estimate_that_fails_says_why_the_map_may_be_wrong(tmp_path):
    left = np.random.default_rng(0).integers(0, 256, (240, 400), dtype=np.uint8)
    right = np.roll(left, -15, axis=1)  # a wall
    write_views(tmp_path, "a.png", left, right)
    run = rollcli("estimate", *VIEWS, "--num-disparities", "16", cwd=tmp_path)
    (row,) = rows_of(run.out)
    assert row["status"] == "error"
    assert row["message"].startswith("no road: ")
    assert "; use a larger --num-disparities" in row["message"]
    with pytest.raises(package.EstimationError) as raised:
        package.estimate_pair(left, right, stereo=package.StereoOptions(num_disparities=16))
    assert str(raised.value) == row["message"]


def carried(text, shape=(30, 40)):
    return _carried(Stored(np.zeros(shape), "png", text=text))


def test_what_a_file_carries_is_read_back_and_what_others_wrote_is_not():
    known = {"slope_error": 0.00125, "doubts": {"match": 'a "doubt"'}, "alignment": {"right_lower_px": 1.25}}
    text = Source(np.zeros((30, 40)), **known, levelled=(1e-3, -2e-3), size=(80, 61)).text
    said = {**known, "doubts": {"carried": 'a "doubt"'}}
    assert carried(text) == {**said, "levelled": (1e-3, -2e-3), "size": (80, 61)}
    assert carried(text, (36, 48))["size"] == (80, 61)
    assert carried(text, (30, 48))["size"] is None  # turned with room for its corners
    of_before = text.replace(', "levelled": [0.001, -0.002], "size": [80, 61]', "")
    assert carried(of_before) == {**said, "levelled": (0.0, 0.0), "size": None}
    assert Source(np.zeros((30, 40)), size=(40, 30)).text == Source(np.zeros((1, 1))).text == ""
    assert text.isascii()
    lies = '{"slope_error": 0, "doubt": "", "alignment": {"right_lower_px": NaN, "right_twist_px": 1}}'
    for other in ("", "{}", "[1]", "null", '{"slope_error": -1, "doubt": "", "alignment": {}}', "no", lies):
        assert carried(other) == {}


def test_what_a_file_carries_cannot_break_a_result():
    """No rig has such numbers, and readers of rows refuse them; a text holds nothing that UTF-8 cannot."""
    whole = {"slope_error": 0.001, "doubt": "", "alignment": {"right_lower_px": 1.25}, "levelled": [0, 0]}
    assert carried(json.dumps(whole)) != {}
    for damaged in (
        {"alignment": {"right_lower_px": 1e300}},
        {"levelled": [1e30, 0]},
        {"levelled": "12"},
        {"size": 2},
        {"size": [10**400, 1]},
    ):
        assert carried(json.dumps(whole | damaged)) == {}
    assert carried(json.dumps(whole | {"size": [-40, -30]}))["size"] is None
    doubtful = carried(json.dumps(whole | {"doubt": "\ud800\x1b \n!"}))
    assert doubtful["doubts"] == {"carried": r"\ud800\x1b !"}
