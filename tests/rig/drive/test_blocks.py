"""Blocks, and the intervals of their means."""

import numpy as np
import pytest
from scipy.stats import t

from rollcli.rig.drive.noise import Noise, hidden, make_blocks, mean_of_blocks, t_quantile

WHITE = Noise(1.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("freedom", [5, 6, 7, 11, 30, 59, 1000])
@pytest.mark.parametrize("chance", [0.05, 0.01])
def test_the_quantile_is_that_of_students_t(freedom, chance):
    remainder = 4 / freedom**5 + 1e-12  # the expansion ends with the fourth power
    assert t_quantile(freedom, chance) == pytest.approx(t.ppf(1 - chance / 2, freedom), rel=remainder)


def test_blocks_are_weighted_means_of_equal_stretches():
    values, weights = np.arange(12.0), np.tile([1.0, 0.0, 3.0], 4)
    blocks = make_blocks(values, weights, 4)
    assert blocks.means == pytest.approx([1.5, 4.5, 7.5, 10.5])
    assert blocks.centres == pytest.approx(blocks.means)
    assert blocks.weights == pytest.approx([4.0] * 4)


def test_blocks_without_a_frame_are_left_out():
    weights = np.ones(40)
    weights[10:20] = 0
    assert len(make_blocks(np.zeros(40), weights, 4).means) == 3


def test_the_interval_of_independent_frames_is_that_of_their_mean():
    halves, textbook = [], []
    for seed in range(40):
        values = np.random.default_rng(seed).normal(0, 1, 600)
        halves.append(mean_of_blocks(values, np.ones(600), WHITE).ci95)
        textbook.append(1.96 * values.std(ddof=1) / np.sqrt(600))
    assert np.mean(halves) == pytest.approx(np.mean(textbook), rel=0.05)


def test_below_eight_blocks_there_is_no_interval_but_how_many_frames_it_takes():
    slow = Noise(1.0, 0.9, 1.0, 19.0)
    found = mean_of_blocks(np.ones(200), np.ones(200), slow)
    assert (found.value, found.ci95, found.needed) == (1.0, None, 304)
    assert mean_of_blocks(np.ones(304), np.ones(304), slow).ci95 is not None


def test_blocks_hide_what_their_alike_neighbours_share():
    """Of AR(1): the variance of the mean over what the blocks' spread tells, all covariances summed."""
    phi, frames, count = 0.9, 120, 4
    covariances = phi ** np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
    parts = covariances.reshape(count, frames // count, count, frames // count).mean(axis=(1, 3))
    told = (np.trace(parts) / count - parts.mean()) / (count - 1)

    assert hidden(Noise(1.0, phi, 1.0, 19.0), frames, count) == pytest.approx(parts.mean() / told, rel=0.02)
    assert hidden(Noise(0.0, 0.0, 0.0, 1.0), frames, count) == 1  # without noise nothing is hidden
