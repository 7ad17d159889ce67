"""The smoothed mounting value, against statsmodels and against a known drift."""

import numpy as np
import pytest
from statsmodels.tsa.statespace.mlemodel import MLEModel

from rollcli.rig.drive.noise import Noise
from rollcli.rig.drive.smoothing import smooth
from tests.rig.drive.series import ar1

NOISE = Noise(0.05, 0.8, 0.8, 9.0)


class _Constant(MLEModel):
    """A constant level, AR(1) and white noise, as statsmodels has them."""

    def __init__(self, series):
        super().__init__(series, k_states=2)
        slow, white = NOISE.variance * NOISE.share, NOISE.variance * (1 - NOISE.share)
        self["design"] = np.array([[1.0, 1.0]])
        self["transition"] = np.diag([1.0, NOISE.phi])
        self["selection"] = np.eye(2)
        self["state_cov"] = np.diag([0.0, slow * (1 - NOISE.phi**2)])
        self["obs_cov"] = np.array([[white]])
        self.ssm.initialize_known(np.zeros(2), np.diag([1e5, slow]))


def test_a_level_that_does_not_move_is_that_of_statsmodels():
    rng = np.random.default_rng(4)
    slow, white = np.sqrt(NOISE.variance * NOISE.share), np.sqrt(NOISE.variance * (1 - NOISE.share))
    series = 1.5 + ar1(rng, 300, NOISE.phi, slow) + rng.normal(0, white, 300)
    found = smooth(series, np.ones(300), NOISE, steps=(0.0,))
    assert np.ptp(found.level) < 1e-6
    expected = _Constant(series - series.mean()).ssm.smooth()
    assert found.level - series.mean() == pytest.approx(expected.smoothed_state[0], abs=1e-4)
    assert found.error**2 == pytest.approx(expected.smoothed_state_cov[0, 0], rel=1e-2)


def test_a_level_that_moves_is_followed_without_the_sway():
    rng = np.random.default_rng(1)
    truth = np.linspace(0, 2, 4000)
    series = truth + ar1(rng, 4000, 0.8, 0.2) + rng.normal(0, 0.1, 4000)
    found = smooth(series, np.ones(4000), NOISE)
    errors = found.level - np.interp(found.frames, np.arange(4000), truth)
    assert np.sqrt(np.mean(errors**2)) < 0.1
    assert len(found.frames) == 400


def test_frames_that_are_left_out_have_no_say():
    series, weights = np.zeros(200), np.ones(200)
    series[50:60], weights[50:60] = 100.0, 0.0
    found = smooth(series, weights, NOISE)
    assert len(found.frames) == 190
    assert np.abs(found.level).max() < 1e-9


def test_a_level_stands_in_the_middle_of_the_frames_that_it_is_of():
    found = smooth(np.linspace(0, 1, 1195), np.ones(1195), NOISE)
    middles = [np.mean(cell) for cell in np.array_split(np.arange(1197), 399)]
    assert found.cell == 3
    assert found.frames[:-1] == pytest.approx(middles[:-1])
    assert found.frames[-1] == 1194  # the last cell holds one frame
