"""The best way to cut a series into stretches of constant mean, by dynamic programming: exact."""

import numpy as np

from rollcli.rig.sequence.weights import Floats


def best_partitions(means: Floats, weights: Floats, most: int) -> list[list[int]]:
    """Find the partitions of least weighted squares into 1, 2, ... stretches.

    Parameters
    ----------
    means : ndarray of float, shape (K,)
        Block means, in order.
    weights : ndarray of float, shape (K,)
        Of the blocks; 0 for one that holds nothing.
    most : int
        The largest number of changes to look for.

    Returns
    -------
    list of list of int
        For 0, 1, ... changes the first block of each stretch but the first.

    Notes
    -----
    F_c[t] = min over s < t of F_{c-1}[s] + cost(s, t), in O(most K^2) [Bellman 1961; Auger, Lawrence 1989].
    """
    k = len(means)
    costs = _costs(means, weights)
    best = costs[0]  # of the first t blocks, without a change
    origins: list[list[int]] = []
    partitions: list[list[int]] = [[]]
    for changes in range(1, min(most, k - 1) + 1):
        table = best[:, None] + costs
        origin = table.argmin(axis=0)
        best = table[origin, np.arange(k + 1)]
        origins.append(origin.tolist())
        partitions.append(_trace(origins, changes, k))
    return partitions


def _costs(means: Floats, weights: Floats) -> Floats:
    """Weighted squares about the mean of blocks s to t - 1, for every s < t; infinite elsewhere."""
    centred = means - np.average(means, weights=weights)  # differences of large sums lose digits
    sums = [np.concatenate([[0.0], np.cumsum(weights * centred**power)]) for power in range(3)]
    w, wx, wxx = (each[None, :] - each[:, None] for each in sums)
    costs = wxx - wx**2 / np.where(w > 0, w, 1.0)
    costs[np.tril_indices(len(means) + 1)] = np.inf
    return np.asarray(np.maximum(costs, 0.0))


def _trace(origins: list[list[int]], changes: int, end: int) -> list[int]:
    """Return the starts of the stretches, from the last one back."""
    starts: list[int] = []
    for level in range(changes - 1, -1, -1):
        end = origins[level][end]
        starts.append(end)
    return starts[::-1]
