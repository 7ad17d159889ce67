"""Vectors as arrays."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vectors = NDArray[Any]


def dot(a: Vectors, b: Vectors) -> Vectors:
    """Return a . b for each vector; each of the two is (3, N), (3, 1) or (3,)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def dots(axes: Vectors, vectors: Vectors) -> Vectors:
    """Return the components (K, N) of `vectors` (3, N) along each of `axes` (K, 3)."""
    return np.asarray(np.einsum("ki,in->kn", axes, vectors))


def groups(labels: NDArray[np.int16], n: int) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Yield each label from 0 to n - 1 that occurs, and its indices."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(n + 1))
    for k in np.flatnonzero(np.diff(starts)):
        yield int(k), order[starts[k] : starts[k + 1]]
