"""Generalised least squares in cells, against the covariance of the frames themselves."""

import numpy as np
import pytest
from scipy.linalg import solve

from rollcli.rig.drive.jumps import make_cells
from tests.rig.drive.series import drive

PHI, SLOW = 0.9, 0.04


@pytest.fixture(scope="module")
def cells():
    values, errors = drive(1, 240, phi=PHI, sd=SLOW**0.5, jump=0.6)
    return values, errors, make_cells(values, np.ones(240), errors**2, SLOW, PHI, 1)


def frame_covariance(errors):
    lags = np.abs(np.subtract.outer(np.arange(len(errors)), np.arange(len(errors))))
    return SLOW * PHI**lags + np.diag(errors**2)


def test_cells_of_one_frame_are_the_frames(cells):
    values, errors, made = cells
    assert made.values == pytest.approx(values)
    assert made.precision @ frame_covariance(errors) == pytest.approx(np.eye(240), abs=1e-8)
    assert made.log_determinant == pytest.approx(np.linalg.slogdet(frame_covariance(errors))[1])


def test_a_step_has_the_size_of_generalised_least_squares(cells):
    values, errors, made = cells
    design = made.design([120], drift=True)
    beta, covariance, squares = made.solve(design)
    weighted = solve(frame_covariance(errors), design, assume_a="pos")
    expected = np.linalg.solve(design.T @ weighted, weighted.T @ values)
    assert beta == pytest.approx(expected, rel=1e-6)
    assert covariance == pytest.approx(np.linalg.inv(design.T @ weighted), rel=1e-6)
    left = values - design @ expected
    assert squares == pytest.approx(left @ solve(frame_covariance(errors), left), rel=1e-6)


def test_the_scan_gives_what_each_further_step_gains(cells):
    _, _, made = cells
    gains = made.gains(made.design([60], drift=False))
    _, _, before = made.solve(made.design([60], drift=False))
    for start in (1, 30, 61, 120, 200, 239):
        _, _, after = made.solve(made.design([60, start], drift=False))
        assert gains[start] == pytest.approx(before - after, rel=1e-6, abs=1e-9)
    assert gains[0] == gains[60] == 0


def test_wider_cells_have_the_covariance_of_means_of_frames():
    errors = np.full(240, 0.1)
    made = make_cells(np.zeros(240), np.ones(240), errors**2, SLOW, PHI, 6)
    mean = np.kron(np.eye(40), np.full((1, 6), 1 / 6))
    expected = mean @ frame_covariance(errors) @ mean.T
    assert np.linalg.inv(made.precision) == pytest.approx(expected, rel=1e-6)


def test_missing_frames_leave_a_gap_in_time():
    weights = np.ones(240)
    weights[50:100] = 0
    made = make_cells(np.arange(240.0), weights, np.full(240, 0.01), SLOW, PHI, 5)
    assert made.first.tolist() == [*range(0, 50, 5), *range(100, 240, 5)]
