"""The paper's experiments on one map, and their tables over several."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.solvers.exact import exact
from rollcli.evaluate.experiments import SOLVERS, _best, examine, rotate_nearest, time_solvers
from rollcli.evaluate.paper_tables import DELTAS_DEG, METHOD_NAMES, all_tables, column
from tests.estimator.synthetic_maps import bent_road, degrees_apart, energy_of

TURNS = [math.radians(turn) for turn in (-10, 0, 15)]
TWO_ROWS = np.array([[20.0, 20.3], [20.4, 20.6]])  # of pixels, which determine no parabola


@pytest.fixture(scope="module")
def found():
    return examine("a.png", bent_road(3, width=240, height=160, noise=0.1), TURNS, None, chosen=False)


@pytest.mark.parametrize("turn_deg", [-90, -37, -20, -2, 0, 4, 20, 90])
def test_rotating_a_map_adds_the_angle_to_its_roll(turn_deg):
    disparity = bent_road(3, width=300, height=200)
    rotated = rotate_nearest(disparity, math.radians(turn_deg))
    assert degrees_apart(exact(energy_of(rotated)).theta, math.radians(3 + turn_deg)) < 0.01


def test_golden_section_is_as_accurate_as_its_tolerance_and_descent_more(found):
    mean = {name: np.degrees(found.solver_errors[name]).mean(axis=0) for name in SOLVERS}
    assert mean["gss"][0] > 10 * mean["gd"][-1]
    np.testing.assert_allclose(mean["gd"][-1], mean["exact"][-1], atol=1e-6)
    assert (mean["exact"] < 0.005).all()


def test_every_method_follows_the_rotations(found):
    for name in METHOD_NAMES:
        errors = found.method_errors[name]
        assert len(errors) == len(TURNS)
        assert max(math.degrees(error) for error in errors) < 0.5, name


def test_a_method_without_an_angle_is_counted_and_leaves_the_others_alone():
    upward = bent_road(180, width=120, height=90)  # no road: disparity grows upward
    found = examine("a", upward, [0.0], None, chosen=False)
    assert found.method_errors["areas"] == (None,)
    assert found.method_errors["line"][0] is not None
    methods = all_tables([found], [], [time_solvers(upward)])["methods_accuracy"]
    assert column(methods, "no_angle", method="areas") == [1]
    assert column(methods, "mean_deg", method="areas") == [None]


def test_a_map_without_an_angle_is_refused():
    with pytest.raises(EstimationError):
        examine("a", np.zeros((50, 60)), TURNS, None, chosen=False)


def test_runs_that_stopped_short_are_left_out_of_the_mean_and_counted(found):
    short = replace(found, sweep=tuple((None, *counts[1:]) for counts in found.sweep))
    slower = replace(found, sweep=tuple(tuple(count and count + 4 for count in each) for each in found.sweep))
    times = [time_solvers(TWO_ROWS)]
    table = all_tables([found, slower], [], times)["fig3_lambda0"]
    for name, more in (("mean", 2), ("min", 0), ("max", 4)):
        assert column(table, name, lambda0=26.0) == [counts[25] + more for counts in found.sweep]
    table = all_tables([found, short], [], times)["fig3_lambda0"]
    # the whole numbers that the command's help names
    assert column(table, "lambda0", delta_deg=DELTAS_DEG[0]) == list(range(1, 101))
    (row,) = (each for each in table if (each["lambda0"], each["delta_deg"]) == (1.0, 0.0001))
    assert row["short"] == 1 + (found.sweep[-1][0] is None)
    assert row["mean"] == found.sweep[-1][0]


def test_a_time_is_that_of_the_fastest_run():
    pauses = iter([0.2, 0.0, 0.2])
    assert _best(lambda: time.sleep(next(pauses)), 3) < 0.1


def test_solvers_are_timed_on_pixels_of_two_rows_which_determine_no_parabola():
    assert examine("a", TWO_ROWS, [0.0], None, chosen=False).pixels == time_solvers(TWO_ROWS).pixels == 4
