"""The frame of a jump, against a scan of every frame with the covariance written out."""

import numpy as np
import pytest

from rollcli.rig.drive.jumps import Cells, Fit, Series, place_jump
from rollcli.rig.drive.noise import Noise
from tests.rig.drive.series import ar1

PHI, SLOW = 0.97, 0.04


def found(starts, *, first, phi=PHI, width=1):
    """What a search has found, in cells that begin at these frames, `width` frames averaged before it."""
    count = len(first)
    cells = Cells(np.asarray(first), np.zeros(count), np.eye(count), 0.0, phi)
    noise = Noise(SLOW, phi**width, 1.0, 10.0 / width)
    return Fit(tuple(starts), False, cells, np.ones(count), noise, SLOW, 1.0, 0.0, 0.0)


def likeliest(values, errors, places):
    """The start of the step that generalised least squares gains most by."""
    lags = np.abs(np.subtract.outer(np.arange(len(values)), np.arange(len(values))))
    precision = np.linalg.inv(SLOW * PHI**lags + np.diag(errors**2))

    def left(start):
        design = np.column_stack([np.ones(len(values)), np.arange(len(values)) >= start])
        beta = np.linalg.solve(design.T @ precision @ design, design.T @ precision @ values)
        rest = values - design @ beta
        return rest @ precision @ rest

    return min(places, key=left)


@pytest.mark.parametrize("width", [1, 3])
@pytest.mark.parametrize(("jump", "errors", "least"), [(0.5, (0.02, 0.1), 30), (0.3, (0.1, 0.2), 25)])
def test_the_frame_is_the_likeliest_of_those_near_the_cell(width, jump, errors, least):
    same, cell = 0, 6
    for seed in range(30):
        rng = np.random.default_rng(seed)
        at = 400 + int(rng.integers(-4, 5))
        own = rng.uniform(*errors, 800)
        values = ar1(rng, 800, PHI, SLOW**0.5) + rng.normal(0, 1, 800) * own
        values[at:] += jump
        series = Series(values, own**2, np.ones(800, dtype=bool))
        fit = found([400 // cell], first=np.arange(0, 800, cell) // width, width=width)
        expected = likeliest(values[200:600], own[200:600], range(180, 220)) + 200
        same += place_jump(series, fit, 0, width) == expected
    # a small jump lets frames that are farther away look likelier now and then
    assert same >= least


def test_a_jump_stays_between_its_neighbours():
    values = np.repeat([0.0, 5.0, 0.0], [100, 20, 100])
    series = Series(values, np.full(220, 1e-4), np.ones(220, dtype=bool))
    fit = found([11, 12], first=np.arange(0, 220, 10))  # 110 and 120: the first jump is at 100 by right
    assert place_jump(series, fit, 0, 1) == 100
    assert place_jump(series, fit, 1, 1) == 120
    close = found([12, 13], first=np.arange(0, 220, 10))
    assert place_jump(series, close, 1, 1) > 120


def test_cells_of_single_frames_are_looked_at_no_more_closely():
    series = Series(np.repeat([0.0, 5.0], 50), np.full(100, 1e-4), np.ones(100, dtype=bool))
    assert place_jump(series, found([47], first=np.arange(100)), 0, 1) == 47


def test_frames_that_are_left_out_hold_no_jump():
    used = np.ones(200, dtype=bool)
    used[90:110] = False
    values = np.where(used, np.repeat([0.0, 5.0], 100), 0.0)
    series = Series(values, np.full(200, 1e-4), used)
    # cells without a frame are left out
    assert place_jump(series, found([9], first=[*range(0, 90, 10), *range(110, 200, 10)]), 0, 1) == 110
