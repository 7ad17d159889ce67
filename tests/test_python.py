"""What a programmer meets: every public name typed, examples that hold, each mistake one clear error."""

import dataclasses
import doctest
import importlib
import inspect
import json
import math
import re
import sys
import types
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import cv2
import numpy as np
import pytest

import rollcli
from rollcli.estimator import estimate
from rollcli.estimator.request import Request
from rollcli.rig.calibration import Calibration
from rollcli.run import diagnosis
from tests import typed_client
from tests.estimator.synthetic_maps import banked_road
from tests.reference_page import PAGE, page
from tests.run_cli import ROOT, ended, python
from tests.run_cli import rollcli as run

MAP = ROOT / "sample_data" / "maps" / "frame_0001.png"
CALIB = ROOT / "sample_data" / "calib.txt"


@pytest.fixture(scope="module")
def disparity():
    return rollcli.read_disparity(MAP)


def test_a_client_that_uses_every_public_name_runs(tmp_path):
    with np.errstate(all="raise"):  # of the program alone: what the functions do within is their own
        rig = typed_client.main(tmp_path)
    assert rig.used == 12
    assert abs(rig.now().value - math.degrees(0.1)) < 0.05
    source = (ROOT / "tests" / "typed_client.py").read_text("utf-8")
    missing = [name for name in rollcli.__all__ if not re.search(rf"\b{name}\b", source)]
    assert missing == []


@pytest.mark.slow
def test_that_client_type_checks_against_an_editable_install(tmp_path):
    pytest.importorskip("mypy", reason="mypy, of what tests need, is not here")
    client = tmp_path / "client.py"
    source = (ROOT / "tests" / "typed_client.py").read_text("utf-8")
    python = _editable(tmp_path / "environment")
    for text, status in (
        ("", 0),
        ("from rollcli import *\nv_disparity(height_map(road(0.1), estimate_roll(road(0.1))))", 0),
        ("rollcli.derotate(1, rol=2)", 1),
        ("rollcli.estimate_rol", 1),
    ):
        client.write_text(f"{source}\n{text}\n", "utf-8")
        line = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", "--python-executable", python]
        done = ended([*line, "client.py"], tmp_path, env=None)
        assert done.returncode == status, done.stdout + done.stderr


def _editable(folder):
    """Make an environment with an editable rollcli, and the packages of this one; return its Python."""
    ended([sys.executable, "-m", "venv", "--system-site-packages", folder], ROOT, env=None, check=True)
    (site,) = folder.glob("lib/python*/site-packages")
    others = [path for path in sys.path if "site-packages" in path]
    (site / "others.pth").write_text("\n".join(others) + "\n")
    python = str(folder / "bin" / "python")
    line = [python, "-m", "pip", "install", "--quiet", "--no-deps", "--editable", str(ROOT)]
    done = ended(line, ROOT, env=None)
    if done.returncode:
        pytest.skip(f"pip cannot build here: {done.stderr.strip()[-200:]}")
    return python


def test_keywords_of_compute_disparity_are_the_fields_of_its_options():
    keywords = {
        name: each.default
        for name, each in inspect.signature(rollcli.compute_disparity).parameters.items()
        if each.kind is each.KEYWORD_ONLY
    }
    fields = {each.name: each.default for each in dataclasses.fields(rollcli.StereoOptions)}
    assert keywords == fields | {"calibration": None}


def test_every_parameter_and_result_of_a_public_function_has_a_type():
    for name in rollcli.__all__:
        if inspect.isfunction(function := getattr(rollcli, name)):
            signature = inspect.signature(function)
            annotations = [each.annotation for each in signature.parameters.values()]
            assert inspect.Signature.empty not in (*annotations, signature.return_annotation), name
            assert not any(each.kind is each.VAR_KEYWORD for each in signature.parameters.values()), name


def test_a_calibration_may_be_the_path_of_its_file(disparity):
    read = rollcli.estimate_roll(disparity, calibration=rollcli.read_calibration(CALIB))
    assert read.pitch is not None
    assert rollcli.estimate_roll(disparity, calibration=CALIB).to_dict() == read.to_dict()
    assert rollcli.estimate_roll(disparity, calibration=str(CALIB)).to_dict() == read.to_dict()
    left, right = (cv2.imread(f"{ROOT}/sample_data/{side}/frame_0001.png") for side in ("left", "right"))
    assert rollcli.estimate_pair(left, right, calibration=str(CALIB)).height_m > 1


def test_of_a_cropped_map_the_lane_is_the_one_below_the_principal_point():
    cropped = banked_road(2, cropped=200)
    rig = Calibration(360, 360, 110, 94, 0.5)

    assert abs(rollcli.estimate_roll(cropped, calibration=rig).image_roll_deg - 2) < 0.02
    assert abs(rollcli.estimate_roll(cropped).roll_deg - 2) > 1


def test_what_is_no_calibration_is_said(disparity):
    estimate = rollcli.estimate_roll(disparity)
    for call in (
        lambda: rollcli.estimate_roll(disparity, calibration="no such file.txt"),
        lambda: rollcli.estimate_roll(disparity, calibration=700.0),
        lambda: rollcli.height_map(disparity, estimate, str(CALIB)),
        lambda: rollcli.read_disparity(MAP, encoding="depth", calibration=str(CALIB)),
    ):
        said = r"no such file|no calibration: give rollcli\.read_cal"
        with pytest.raises(rollcli.RollcliError, match=said):
            call()


def test_each_setting_of_the_estimator_has_its_default_and_reaches_it(monkeypatch):
    asked = vars(Request("gss", "line", "all", 3.0, 1e-3, 0.2, 0.1, 1e-4, 7))
    view = np.random.default_rng(0).integers(0, 256, (120, 320), dtype=np.uint8)
    refuse = Mock(side_effect=rollcli.EstimationError("refused"))
    for module in (estimate, diagnosis):
        monkeypatch.setattr(module, "estimate_roll", refuse)
    own = {"disparity", "left", "right", "stereo", "calibration", "mask", "road_mask"}
    for call, *views in ((rollcli.estimate_roll, view), (rollcli.estimate_pair, view, np.roll(view, -10, 1))):
        named = inspect.signature(call).parameters
        given = {name: value for name, value in asked.items() if name in named}
        assert asked.keys() - named.keys() - {"tuning", "middle", "doffs", "aspect"} == (
            {"slope_error"} if len(views) == 2 else set()
        )
        assert named.keys() - asked.keys() <= own
        assert all(named[name].default == getattr(Request(), name) for name in given)
        refuse.reset_mock()
        with pytest.raises(rollcli.EstimationError, match="refused"):
            call(*views, **given)
        first, *_ = refuse.call_args_list  # later ones look for a road in the map seen as something else
        assert given.items() <= vars(first.args[1]).items()
    with pytest.raises(TypeError, match="metod"):
        rollcli.estimate_roll(view, metod="exact")


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_a_crop_that_leaves_nothing_is_said(shape):
    with pytest.raises(rollcli.EstimationError, match="no valid pixel"):
        rollcli.estimate_roll(np.ones(shape))


def test_an_image_that_was_not_read_is_said():
    image = np.zeros((100, 200), np.uint8)
    for call in (rollcli.compute_disparity, rollcli.estimate_pair):
        for left, right, said in ((None, image, "left image is None"), (image, None, "right image is None")):
            with pytest.raises(rollcli.InputError, match=said):
                call(left, right)
        with pytest.raises(rollcli.InputError, match="right image is no array"):
            call(image, "right.png")
    with pytest.raises(rollcli.InputError, match="no pixel could be matched with the right image"):
        rollcli.estimate_pair(image, image)
    estimate = rollcli.estimate_roll(rollcli.read_disparity(MAP))
    for call in (
        rollcli.estimate_roll,
        rollcli.v_disparity,
        lambda each: rollcli.derotate(each, 0.1),
        lambda each: rollcli.height_map(each, estimate),
    ):
        for wrong in (None, [[1, 2], [3]], "map.png", np.ones((360, 480), complex), 1.0):
            with pytest.raises(rollcli.UsageError, match=r"map.* (real|None)"):
                call(wrong)


def test_a_mask_that_leaves_nothing_of_a_pair_is_said():
    image = np.random.default_rng(0).integers(0, 256, (100, 200), dtype=np.uint8)
    with pytest.raises(rollcli.UsageError, match="mask leaves no pixel"):
        rollcli.estimate_pair(image, image, mask=np.zeros(image.shape))
    for wrong in ([[1, 2], [3]], "mask.png", np.ones((100, 200, 3), np.uint8)):
        for call in (lambda mask: rollcli.estimate_pair(image, image, mask=mask), masked_roll):
            with pytest.raises(rollcli.UsageError, match="a mask is a 2-D array"):
                call(wrong)


def masked_roll(mask):
    return rollcli.estimate_roll(typed_client.road(0.1), mask=mask)


def test_numbers_and_rows_of_numpy_are_taken_or_refused_in_words():
    left, right = (cv2.imread(f"{ROOT}/sample_data/{side}/frame_0001.png", 0) for side in ("left", "right"))
    given = [rollcli.compute_disparity(left, right, vertical_offset=each) for each in (1, np.int64(1))]
    assert np.array_equal(*given)
    with pytest.raises(rollcli.InputError, match="the left image is no array of pixels"):
        rollcli.compute_disparity(left[0], right[0])
    road, rolls = typed_client.road(0.1), {"roll_deg": [1, 1], "status": ["ok", "ok"]}
    for said, call in (
        ("what is of type NoneType is no estimate", lambda: rollcli.height_map(road, None)),
        (r", \d+\), not of shape \(\)", lambda: rollcli.height_map(1.0, rollcli.estimate_roll(road))),
        ("at most 65535 bins", lambda: rollcli.v_disparity(road, bins=10**9)),
        ("1 origins of 2 rows: give one for each, or none", lambda: rollcli.assess_rig(rolls, origins=["a"])),
        ("of type ndarray is no calibration", lambda: rollcli.estimate_roll(road, calibration=left)),
    ):
        with pytest.raises(rollcli.UsageError, match=said):
            call()


def test_what_a_masked_array_hides_and_what_is_beyond_any_disparity_is_no_data(disparity):
    hidden = np.broadcast_to(np.arange(disparity.shape[1]) >= 300, disparity.shape)
    masked = np.ma.MaskedArray(disparity, hidden)
    cut = np.where(hidden, 0, disparity)
    estimate = rollcli.estimate_roll(masked)
    assert estimate.to_dict() == rollcli.estimate_roll(cut).to_dict()
    assert estimate.to_dict() != rollcli.estimate_roll(disparity).to_dict()
    heights = rollcli.height_map(cut, estimate)
    for given in (masked, np.where(hidden, np.float32(1e15), disparity)):
        assert np.array_equal(rollcli.v_disparity(given).counts, rollcli.v_disparity(cut).counts)
        assert np.array_equal(rollcli.derotate(given, 0.1), rollcli.derotate(cut, 0.1))
        assert np.array_equal(rollcli.height_map(given, estimate), heights, equal_nan=True)
    of_masked = rollcli.estimate_roll(disparity, mask=np.ma.MaskedArray(np.ones(disparity.shape), hidden))
    assert of_masked.to_dict() == rollcli.estimate_roll(disparity, mask=~hidden).to_dict()


def test_an_estimate_is_json_and_its_columns_are_those_of_the_command(tmp_path):
    estimate = rollcli.estimate_roll(rollcli.read_disparity(MAP), calibration=CALIB)
    said = json.loads(json.dumps(estimate.to_dict()))
    done = run("estimate", str(MAP), "--calib", str(CALIB), "--format", "jsonl", "-q", cwd=tmp_path)
    row = json.loads(done.out)
    for name, value in said.items():
        if name != "image_roll_deg":  # a column where fx and fy differ
            assert row[name] == (
                pytest.approx(value, abs=1e-6, rel=1e-6) if isinstance(value, float) else value
            )
    assert said["roll_deg"] == estimate.roll_deg == math.degrees(estimate.theta)


def test_a_rig_is_assessed_from_estimates_as_from_their_rows(disparity):
    estimates = [rollcli.estimate_roll(typed_client.road(0.1, seed)) for seed in range(10)]
    from_rows = rollcli.assess_rig([each.to_dict() for each in estimates])
    assert rollcli.assess_rig(estimates).now() == from_rows.now()
    assert from_rows.now().value == pytest.approx(math.degrees(0.1), abs=0.05)


def test_a_depth_map_is_told_as_the_command_tells_it(disparity):
    depth = np.where(disparity > 0, 400 / np.maximum(disparity, 1e-3), 0).astype(np.float32)
    found = rollcli.estimate_roll(depth)
    assert found.status == "suspect"
    assert found.message.startswith("looks like a depth map: give focal length times baseline")
    assert "--" not in found.message
    stored = rollcli.estimate_roll(disparity * 256, calibration=CALIB)
    assert stored.status == "suspect"
    assert stored.message.endswith("the numbers look 256 times too large; give the numbers / 256")
    shares = rollcli.estimate_roll(disparity / 1000, calibration=CALIB)
    assert (shares.status, shares.message[:24]) == ("suspect", "no disparity reaches 1 p")


def test_a_photograph_is_told_as_the_command_tells_it():
    colours = cv2.imread(str(ROOT / "sample_data" / "left" / "frame_0001.png"))
    with pytest.raises(rollcli.UsageError, match=r"give both views to rollcli\.estimate_pair"):
        rollcli.estimate_roll(colours)
    try:
        said = rollcli.estimate_roll(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY)).message
    except rollcli.EstimationError as error:
        said = str(error)
    assert said.startswith("looks like a photograph")
    assert "estimate_pair" in said


def test_threads_may_call_it_at_the_same_time():
    maps = [rollcli.read_disparity(path) for path in sorted(MAP.parent.iterdir())] * 3
    one_by_one = [rollcli.estimate_roll(each).to_dict() for each in maps]
    with ThreadPoolExecutor(4) as pool:
        assert [each.to_dict() for each in pool.map(rollcli.estimate_roll, maps)] == one_by_one
    assert isinstance(rollcli.read_calibration(CALIB), Calibration)


def test_a_program_that_loads_it_hears_matplotlibs_warnings_as_before():
    python("from rollcli import *; from logging import *; exit(getLogger('matplotlib').level)", check=True)


def test_the_page_of_reference_is_what_the_docstrings_say():
    assert PAGE.read_text("utf-8") == page(), "run python -m tests.reference_page"
    for name in rollcli.__all__:
        if not name.startswith("_"):
            assert f"\n### {name}\n" in page()


FUNCTIONS = [name for name in rollcli.__all__ if isinstance(getattr(rollcli, name), types.FunctionType)]
README = (ROOT / "README.md").read_text("utf-8")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_examples_of_a_public_function_hold(name):
    function = getattr(rollcli, name)
    module = importlib.import_module(function.__module__)
    found = doctest.DocTestFinder(recurse=False).find(function, name, globs=vars(module).copy())
    runner = doctest.DocTestRunner()
    with np.printoptions(legacy=False):
        for test in found:
            runner.run(test)
    assert runner.tries > 0
    assert runner.failures == 0


def test_the_readmes_session_in_python_holds(tmp_path, monkeypatch):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    (session,) = re.findall(r"```python\n(.*?)```", README, flags=re.S)
    test = doctest.DocTestParser().get_doctest(session, {}, "README.md", "README.md", 0)
    runner = doctest.DocTestRunner()
    runner.run(test)
    assert runner.tries == 10
    assert runner.failures == 0
    assert (tmp_path / "v.png").stat().st_size > 1000
