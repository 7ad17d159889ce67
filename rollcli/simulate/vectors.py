"""Vectors as arrays, and the first crossing of a ray with a polynomial surface."""

from collections.abc import Iterator
from itertools import pairwise
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


_MOST_STEPS = 80  # bisection alone reaches the precision of a double in 60
_PRECISION = 1e-12  # of a step of Newton's; the next one would be its square


def first_crossing(coefficients: Array, end: Array) -> Array:
    """Find the first root in (0, `end`] of polynomials that are positive at 0.

    Between the roots of its derivative a polynomial is monotone: it has one root there or none, and the signs
    at both ends tell which.

    Parameters
    ----------
    coefficients : numpy.ndarray
        (degree + 1, N), the constant first.
    end : numpy.ndarray
        (N,), more than 0.

    Returns
    -------
    numpy.ndarray
        (N,); nan where there is no such root, or the polynomial is not positive at 0.
    """
    found = np.full(end.shape, np.nan)
    searched = coefficients[0] > 0
    knots = _turning_points(coefficients, end)
    for low, high in pairwise(knots):
        crossed = np.flatnonzero(searched & (_values(coefficients, high) <= 0))
        found[crossed] = _roots(coefficients[:, crossed], low[crossed], high[crossed])
        searched[crossed] = False
    return found


def _turning_points(coefficients: Array, end: Array) -> list[Array]:
    """Return ascending points from 0 to `end`, from one to the next of which the polynomials are monotone."""
    if len(coefficients) == 2:
        return [np.zeros_like(end), end]
    derivative = coefficients[1:] * np.arange(1.0, len(coefficients))[:, None]
    knots = _turning_points(derivative, end)
    turns = []
    for low, high in pairwise(knots):
        at = np.flatnonzero(_values(derivative, low) * _values(derivative, high) < 0)
        turn = high.copy()
        turn[at] = _roots(derivative[:, at], low[at], high[at])
        turns.append(turn)
    return [knots[0], *turns, end]


def _roots(coefficients: Array, low: Array, high: Array) -> Array:
    """Find the root of each polynomial between `low` and `high`, at which its signs differ.

    Takes Newton's steps, and bisects where a step would leave the bracket.
    """
    root, moving = (low + high) / 2, np.arange(len(low))
    derivative = coefficients[1:] * np.arange(1.0, len(coefficients))[:, None]
    falling = _values(coefficients, low) > _values(coefficients, high)
    for _ in range(_MOST_STEPS):
        at = root[moving]
        value = _values(coefficients, at)
        before = (value > 0) == falling
        low, high = np.where(before, at, low), np.where(before, high, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = at - value / _values(derivative, at)
        root[moving] = np.where((step >= low) & (step <= high), step, (low + high) / 2)
        still = np.abs(root[moving] - at) > _PRECISION * at
        if not still.any():
            break
        moving, low, high, falling = moving[still], low[still], high[still], falling[still]
        coefficients, derivative = coefficients[:, still], derivative[:, still]
    return root


def _values(coefficients: Array, at: Array) -> Array:
    """Evaluate the polynomials at `at` by Horner's rule."""
    value = coefficients[-1].copy()
    for coefficient in coefficients[-2::-1]:
        value = value * at + coefficient
    return np.asarray(value)
