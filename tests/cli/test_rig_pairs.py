"""The health of a pair, from rendered views that are turned, lowered and enlarged, to its correction."""

import json
import math
import re
import shutil

import cv2
import numpy as np
import pytest

from tests.odd_views import seen_by, seen_turned
from tests.run_cli import rollcli, rows_of
from tests.sessions import play

pytestmark = pytest.mark.slow

TRUTH = {"right_lower_px": 1.2, "right_clockwise_deg": 0.15, "right_larger_percent": 0.3}
NEAR = {"right_lower_px": 0.1, "right_clockwise_deg": 0.02, "right_larger_percent": 0.05}


def put_off(path, target, larger=0.3):
    """Turn a view by 0.15 degrees about its centre, enlarge it by so many percent and lower it by 1.2 px."""
    view = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    moved = seen_by(view, clockwise_deg=0.15, larger_percent=larger, lower=1.2, border=cv2.BORDER_REPLICATE)
    cv2.imwrite(str(target / path.name), moved)


def rolls(path):
    return np.array([float(row["roll_deg"]) for row in rows_of(path.read_text())])


def columns(path):
    return json.loads(path.read_text())["columns"]


def estimate(folder, right, name, *how):
    """The rows NAME.csv of the left views with right ones of a folder."""
    line = ("estimate", "--left", "left", "--right", right, *how, "-o", f"{name}.csv", "-q")
    rollcli(*line, cwd=folder, status=0)


def assert_as_level(folder, name):
    """The angles of these rows must be those of the untouched pairs."""
    apart = np.abs(rolls(folder / f"{name}.csv") - rolls(folder / "level.csv"))
    assert np.median(apart) <= 0.02
    assert apart.max() <= 0.08


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Twelve pairs, the same with right views that are put off, and what was measured of these."""
    folder = tmp_path_factory.mktemp("pairs")
    scene = ("--scene", "mixed", "--size", "480x360", "--roll=-3:3", "-q")
    assert rollcli("simulate", ".", "--frames", "12", *scene, cwd=folder).status == 0
    (folder / "off").mkdir()
    for path in sorted((folder / "right").iterdir()):
        put_off(path, folder / "off")
    estimate(folder, "right", "level")
    estimate(folder, "off", "off")
    assert rollcli("rig", "off.csv", "--correction", "use.json", "-q", cwd=folder).status == 0
    return folder


def test_how_the_right_view_lies_is_found_within_its_interval_and_gated(pairs):
    asked = ("--max-misalignment", "1", "--correction", "c.json", "--overwrite", "--format", "json", "-q")
    done = rollcli("rig", "off.csv", *asked, cwd=pairs, status=4)
    found = json.loads(done.out)["alignment"]
    assert found["advice"] == "recalibrate"
    for name, truth in TRUTH.items():
        prefix, _, suffix = name.rpartition("_")
        assert abs(found[name] - truth) <= min(NEAR[name], found[f"{prefix}_ci95_{suffix}"])
    level = json.loads(rollcli("rig", "level.csv", "--format", "json", "-q", cwd=pairs).out)["alignment"]
    assert level["advice"] == "level"


def test_each_drive_is_gated_and_the_correction_is_of_the_last_one_alone(pairs):
    drives = ("level.csv", "off.csv", "--max-misalignment", "1", "-q")
    assert rollcli("rig", "off.csv", "level.csv", *drives[2:], cwd=pairs).status == 4
    assert rollcli("rig", *drives, "--correction", "last.json", cwd=pairs).status == 4
    assert columns(pairs / "last.json") == columns(pairs / "use.json")


def test_the_correction_of_a_piped_result_is_what_its_rows_say(pairs):
    result = (pairs / "off.csv").read_text()
    assert rollcli("rig", "-", "--correction", "piped.json", "-q", cwd=pairs, stdin=result).status == 0
    piped, whole = (json.loads((pairs / name).read_text()) for name in ("piped.json", "use.json"))
    assert all(piped[name] == whole[name] for name in TRUTH)


def test_after_a_jump_the_correction_is_of_the_pairs_since(pairs):
    (pairs / "both").mkdir()
    lines = []
    for part, name in enumerate(("level.csv", "off.csv")):
        for path in (pairs / "left").iterdir():
            shutil.copy(path, pairs / "both" / path.name.replace("frame", str(part)))
        lines += (pairs / name).read_text().replace("left/frame", f"both/{part}").splitlines()[bool(part) :]
    (pairs / "jump.csv").write_text("\n".join([*lines, ""]))
    assert rollcli("rig", "jump.csv", "--correction", "jump.json", "-q", cwd=pairs).status == 0
    assert columns(pairs / "jump.json") == columns(pairs / "use.json")


def test_of_a_drift_the_last_pairs_are_matched_again(tmp_path):
    play(tmp_path, "rig drifts.csv seed=5 frames=40 sd=0.02 drift=6 errors=[0.01,0.02] pairs=1.5")
    done = rollcli("rig", "drifts.csv", "--correction", "c.json", "--dry-run", cwd=tmp_path)
    assert re.findall(r"run/(\d+)\.png", done.out) == [str(number) for number in range(16, 40)]


def test_the_error_of_depth_is_the_same_at_each_size_that_pairs_are_matched_at(pairs):
    given = ("--left", "left", "--right", "off", "--downscale", "2")
    assert rollcli("disparity", *given, "-o", "maps", "-q", cwd=pairs).status == 0
    turns = []
    for of, out in ((given, "half.csv"), (("maps",), "maps.csv")):
        done = rollcli("estimate", *of, "--calib", "calib.txt", "-o", out, cwd=pairs)
        turns.append(float(re.search(r"([\d.]+) per 0.1 px of disparity", done.err)[1]))
    assert turns[1] == pytest.approx(turns[0], rel=0.02)
    sized = "cam0=[280 0 239.5; 0 280 179.5; 0 0 1]\nbaseline=540\nwidth=480\nheight=360\n"
    (pairs / "sized.txt").write_text(sized)
    errors = []
    for result in ("off.csv", "half.csv", "maps.csv"):
        for calibration in ("sized.txt", "calib.txt"):
            asked = (result, "--calib", calibration, "--format", "json", "-q")
            found = json.loads(rollcli("rig", *asked, cwd=pairs).out)
            errors.append(found["alignment"]["depth_error_percent"]["10_m"])
    assert errors == pytest.approx([errors[0]] * 6, rel=0.1)
    for each in ("half", "maps"):
        assert rollcli("report", f"{each}.csv", "-o", f"{each}.html", "--gallery", "0", cwd=pairs).status == 0
        assert f"{errors[-1]:.1f} % at 10 m" in (pairs / f"{each}.html").read_text()


def test_with_a_correction_the_angles_are_those_of_the_untouched_pairs(pairs):
    shutil.copy(pairs / "use.json", pairs / "again.json")
    given = ("--left", "left", "--right", "off", "--align", "again.json", "-o", "corrected.csv", "-q")
    assert rollcli("estimate", *given, cwd=pairs).status == 0
    assert_as_level(pairs, "corrected")
    (pairs / "again.json").unlink()  # what was corrected is in the record of the run
    for command in (("rig", "--correction", "../new.json"), ("report", "-o", "../new.html")):
        assert rollcli(*command, "../corrected.csv", cwd=pairs / "off").status == 0
    assert rollcli("rig", "level.csv", "--correction", "again.json", cwd=pairs).status == 0
    for how in ("--resume", "--update"):
        assert "--align again.json has changed" in rollcli("estimate", *given, how, cwd=pairs).refused()


def test_a_drive_tells_a_pitch_from_a_shift_and_levels_its_rows(pairs):
    """No pair alone tells 0.3 degrees of pitch from a view that is 1.8 px lower."""
    (pairs / "pitched").mkdir()
    for path in sorted((pairs / "right").iterdir()):
        pitched = seen_turned(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), pitch_deg=0.3)
        cv2.imwrite(str(pairs / "pitched" / path.name), pitched)
    estimate(pairs, "pitched", "pitched")
    assert rollcli("rig", "pitched.csv", "--correction", "pitch.json", "-q", cwd=pairs).status == 0
    estimate(pairs, "pitched", "unpitched", "--align", "pitch.json")

    bend = json.loads((pairs / "pitch.json").read_text())["right_bend_px"]
    assert bend == pytest.approx(-math.radians(0.3) / (0.7 * 480) * 180**2, rel=0.1)
    assert_as_level(pairs, "unpitched")


def test_the_matrix_brings_the_right_view_back(pairs):
    found = json.loads((pairs / "use.json").read_text())
    x, y, turned = -479 / 2, -359 / 2, math.radians(0.15)
    expected = [1.003 * x - turned * y - x, turned * x + 1.003 * y + 1.2 - y]
    assert (np.array(found["matrix"]) @ [0.0, 0.0, 1.0])[:2] == pytest.approx(expected, abs=0.15)


def test_the_matrix_enlarges_columns_as_is_believed_and_keeps_that_of_the_principal_point(pairs):
    sized = "cam0=[336 0 259.5; 0 168 159.5; 0 0 1]\nbaseline=540\nwidth=480\nheight=360\n"
    (pairs / "off_middle.txt").write_text(sized)
    asked = ("--calib", "off_middle.txt", "--correction", "axis.json", "--overwrite", "-q")
    assert rollcli("rig", "off.csv", *asked, cwd=pairs).status == 0
    found = json.loads((pairs / "axis.json").read_text())
    matrix = np.array(found["matrix"])
    assert (matrix @ [259.5, 159.5, 1.0])[0] == pytest.approx(259.5)
    assert matrix[0, 0] - 1 == pytest.approx(found["columns"]["scale"], abs=1e-6)
    assert matrix[0, 1] == pytest.approx(-4 * matrix[1, 0])  # fx = 2 fy
    assert matrix[1, 1] - 1 == pytest.approx(found["right_larger_percent"] / 100, abs=1e-5)


def test_a_pair_that_contradicts_the_correction_is_suspect(pairs):
    first = ("--left", "left/frame_000[12].png", "--right", "right/frame_000[12].png")
    rows = rows_of(rollcli("estimate", *first, "--align", "use.json", cwd=pairs).out)
    assert [row["status"] for row in rows] == ["suspect"] * 2
    assert all("do not lie as the correction says" in row["message"] for row in rows)


def test_maps_of_pairs_that_lie_as_the_correction_says_ask_for_nothing(pairs):
    first = ("--left", "left/frame_000[12].png", "--right", "off/frame_000[12].png")
    done = rollcli("disparity", *first, "--align", "use.json", "-o", "maps_of_off", cwd=pairs, status=0)
    assert "recalibrate" not in done.err


def test_a_drive_says_how_its_pairs_lie_and_not_what_an_earlier_correction_says(pairs):
    earlier = json.loads((pairs / "use.json").read_text())
    earlier["right_clockwise_deg"] -= 0.05
    (pairs / "earlier.json").write_text(json.dumps(earlier))
    estimate(pairs, "off", "later", "--align", "earlier.json")
    assert rollcli("rig", "later.csv", "--correction", "later.json", "-q", cwd=pairs).status == 0
    later = json.loads((pairs / "later.json").read_text())
    assert all(abs(later[name] - truth) < NEAR[name] for name, truth in TRUTH.items())


def test_intervals_hold_where_right_views_have_grown_a_little_since_the_correction(pairs):
    (pairs / "grown").mkdir()
    for path in sorted((pairs / "right").iterdir()):
        put_off(path, pairs / "grown", larger=0.4)
    estimate(pairs, "grown", "grown", "--align", "use.json")
    apart = np.abs(rolls(pairs / "grown.csv") - rolls(pairs / "level.csv"))
    half = [float(row["roll_ci95_deg"]) for row in rows_of((pairs / "grown.csv").read_text())]
    assert np.mean(apart <= half) >= 0.9


def test_a_correction_is_for_views_of_its_shape_at_any_size(pairs):
    for side in ("left", "right"):
        view = cv2.imread(str(pairs / side / "frame_0001.png"))
        cv2.imwrite(str(pairs / f"crop_{side}.png"), view[80:])
    given = ("--left", "crop_left.png", "--right", "crop_right.png", "--align", "use.json")
    done = rollcli("estimate", *given, cwd=pairs, status=3)
    assert "the correction is for 480x360 px, the views have 480x280" in rows_of(done.out)[0]["message"]
    first = ("--left", "left/frame_0001.png", "--right", "off/frame_0001.png", "--downscale", "1.7")
    assert rollcli("estimate", *first, "--align", "use.json", cwd=pairs).status == 0
