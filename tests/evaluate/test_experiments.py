"""The paper's experiments on one map, and their tables over several."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from rollcli.errors import EstimationError
from rollcli.estimator.solvers.exact import exact
from rollcli.evaluate.experiments import (
    DELTAS,
    FORMS,
    LAMBDAS,
    METHODS,
    SOLVERS,
    Times,
    _best,
    examine,
    rotate_nearest,
    time_solvers,
)
from rollcli.evaluate.tables import DELTAS_DEG, all_tables
from tests.estimator.synthetic_maps import bent_road, degrees_apart, energy_of

TURNS = [math.radians(turn) for turn in (-10, 0, 15)]


@pytest.fixture(scope="module")
def found():
    return examine("a.png", bent_road(3, width=240, height=160, noise=0.1), TURNS)


@pytest.mark.parametrize("turn_deg", [-90, -37, -20, -2, 0, 4, 20, 90])
def test_rotating_a_map_adds_the_angle_to_its_roll(turn_deg):
    disparity = bent_road(3, width=300, height=200)
    rotated = rotate_nearest(disparity, math.radians(turn_deg))
    assert degrees_apart(exact(energy_of(rotated)).theta, math.radians(3 + turn_deg)) < 0.01


@pytest.mark.parametrize("turn_deg", [-70, -20, 8, 33, 160])
def test_a_turned_map_is_as_large_as_its_corners_need(turn_deg):
    disparity = np.ones((60, 90), np.float32)
    for value, corner in enumerate(np.ndindex(2, 2), 2):
        rows, columns = (slice(-3, None) if end else slice(3) for end in corner)
        disparity[rows, columns] = value
    rotated = rotate_nearest(disparity, math.radians(turn_deg))
    assert set(np.unique(rotated)) == {0, 1, 2, 3, 4, 5}
    for border in (rotated[:2], rotated[-2:], rotated[:, :2], rotated[:, -2:]):
        assert 0 < np.count_nonzero(border) < 20  # the tip of a corner


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turns_by_right_angles_move_every_pixel_to_one_place(quarters):
    disparity = np.arange(1, 36, dtype=np.float32).reshape(5, 7)
    assert np.array_equal(rotate_nearest(disparity, quarters * math.pi / 2), np.rot90(disparity, -quarters))


def test_iterations_and_angle_are_those_of_the_map(found):
    assert found.gss == (16, 21, 26, 30)
    assert all(2 <= count <= 8 for count in found.gd)
    assert math.degrees(found.theta) == pytest.approx(3, abs=0.02)
    assert (found.width, found.height, found.pixels) == (240, 160, 240 * 160)


def test_the_sweep_has_a_count_for_each_delta_and_rate_or_none_where_it_stopped_short(found):
    sweep = np.array(found.sweep, dtype=float)
    assert sweep.shape == (len(DELTAS), len(LAMBDAS))
    assert found.sweep[-1][25] == found.gd[-1]  # lambda0 = 26


def test_golden_section_is_as_accurate_as_its_tolerance_and_descent_more(found):
    mean = {name: np.degrees(found.solver_errors[name]).mean(axis=0) for name in SOLVERS}
    assert mean["gss"][0] > 10 * mean["gd"][-1]
    np.testing.assert_allclose(mean["gd"][-1], mean["exact"][-1], atol=1e-6)
    assert (mean["exact"] < 0.005).all()


def test_every_method_follows_the_rotations(found):
    for name in METHODS:
        errors = found.method_errors[name]
        assert len(errors) == len(TURNS)
        assert max(math.degrees(error) for error in errors) < 0.5, name


def test_pixels_without_data_count_for_no_method():
    disparity = bent_road(3, width=120, height=90, noise=0.1)
    disparity[:, :40] = 0
    found = examine("a", disparity, TURNS[:1], truth=math.radians(3), chosen=True)
    assert found.pixels == 80 * 90
    for name in METHODS:
        assert math.degrees(found.method_errors[name][0]) < 0.5, name


def test_a_known_angle_takes_the_place_of_the_maps_own_estimate():
    disparity = bent_road(3, width=120, height=90)
    off = examine("a", disparity, [0.0], truth=math.radians(2))
    assert math.degrees(off.solver_errors["exact"][0][0]) == pytest.approx(1, abs=1e-3)
    assert math.degrees(off.method_errors["line"][0]) == pytest.approx(1, abs=0.1)


def test_the_papers_method_is_its_descent_with_the_smallest_tolerance():
    truth = math.radians(2.9)
    found = examine("a", bent_road(3, width=120, height=90, noise=0.1), TURNS, truth=truth)
    assert found.method_errors["gd"] == tuple(errors[-1] for errors in found.solver_errors["gd"])


def test_a_method_without_an_angle_is_counted_and_leaves_the_others_alone():
    upward = bent_road(180, width=120, height=90)  # no road: disparity grows upward
    found = examine("a", upward, [0.0])
    assert found.method_errors["areas"] == (None,)
    assert found.method_errors["line"][0] is not None
    methods = all_tables([found], [], [time_solvers(upward)])["methods_accuracy"]
    assert methods.where(method="areas").column("no_angle") == [1]
    assert methods.where(method="areas").column("mean_deg") == [None]


def test_a_map_without_an_angle_is_refused():
    with pytest.raises(EstimationError):
        examine("a", np.zeros((50, 60)), TURNS)


def test_times_are_taken_for_each_solver_form_and_delta():
    times = time_solvers(bent_road(2, width=60, height=40, noise=0.1))
    assert set(times.seconds) == {(solver, form) for solver in ("gss", "gd") for form in FORMS}
    assert all(len(seconds) == len(DELTAS) and min(seconds) > 0 for seconds in times.seconds.values())


def made_times(seconds):
    return Times(9, {(solver, form): (seconds,) * 4 for solver in ("gss", "gd") for form in FORMS})


def test_runs_that_stopped_short_are_left_out_of_the_mean_and_counted(found):
    short = replace(found, sweep=tuple((None, *counts[1:]) for counts in found.sweep))
    slower = replace(found, sweep=tuple(tuple(count and count + 4 for count in each) for each in found.sweep))
    table = all_tables([found, slower], [], [made_times(1)])["fig3_lambda0"].where(lambda0=26.0)
    for name, more in (("mean", 2), ("min", 0), ("max", 4)):
        assert table.column(name) == [counts[25] + more for counts in found.sweep]
    table = all_tables([found, short], [], [made_times(1)])["fig3_lambda0"]
    rates = table.where(delta_deg=DELTAS_DEG[0]).column("lambda0")
    assert rates == list(range(1, 101))  # the whole numbers that the command's help names
    row = table.where(lambda0=1.0, delta_deg=0.0001)
    assert row.column("short") == [1 + (found.sweep[-1][0] is None)]
    assert row.column("mean") == [found.sweep[-1][0]]


def test_a_time_is_that_of_the_fastest_run(monkeypatch):
    clock = iter([10.0, 12.0, 20.0, 20.5, 30.0, 33.0])
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    assert _best(lambda: None, 3) == 0.5


def test_a_table_is_csv_that_reads_back(found):
    tables = all_tables([found], [('a "b", c', "why")], [made_times(1 / 3)])
    for table in tables.values():
        lines = list(csv.reader(io.StringIO(table.csv().decode())))
        assert tuple(lines[0]) == table.columns
        assert len(lines) == len(table.rows) + 1
    assert b"0.3333333" in tables["table2_runtime"].csv()
