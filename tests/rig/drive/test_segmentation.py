"""Exact partitions, against ruptures."""

import numpy as np
import pytest
import ruptures

from rollcli.rig.drive.jumps import best_partitions


@pytest.mark.parametrize("seed", range(8))
def test_partitions_are_those_of_ruptures(seed):
    rng = np.random.default_rng(seed)
    means = rng.normal(0, 1, 60) + np.repeat(rng.normal(0, 2, 4), 15)
    found = best_partitions(means, np.ones(60), 4)
    oracle = ruptures.Dynp(model="l2", min_size=1, jump=1).fit(means)
    for changes in range(1, 5):
        assert found[changes] == oracle.predict(n_bkps=changes)[:-1]


def test_weighted_blocks_count_as_so_many_equal_ones():
    rng = np.random.default_rng(1)
    means, weights = rng.normal(0, 1, 25), rng.integers(1, 4, 25)
    found = best_partitions(means, weights.astype(float), 3)
    repeated = best_partitions(np.repeat(means, weights), np.ones(weights.sum()), 3)
    starts = np.cumsum(weights) - weights
    for mine, theirs in zip(found, repeated, strict=True):
        assert [int(starts[start]) for start in mine] == theirs


def test_there_are_no_more_changes_than_places_for_them():
    assert best_partitions(np.array([1.0, 2.0]), np.ones(2), 5) == [[], [1]]
