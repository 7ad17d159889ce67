"""How the right view lies, fitted to blocks that are made up, against what these were made of."""

import numpy as np
import pytest

from rollcli.stereo import row_fit
from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.row_fit import SeenBlocks


def seen_at(lies, noise=0.0, count=400, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-150, 150, count), rng.uniform(-80, 80, count)
    shift = lies.offset + lies.rotation * x + lies.scale * y + lies.twist * x * y
    shift += rng.normal(0, 1, count) * noise
    parts = x, y, rng.uniform(0, 60, count), shift, rng.uniform(2, 50, count)
    return SeenBlocks(*(part.astype(np.float32) for part in parts))


def test_a_fit_without_noise_is_exact_and_outliers_do_not_move_it():
    lies = Misalignment(0.5, -0.004, 0.006, 5e-5)
    seen = seen_at(lies)
    exact, _, spread = row_fit.fit_rows(seen)
    assert exact.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-4)
    assert spread == pytest.approx(0.001, abs=2e-4)
    seen.shift[::6] += 5
    robust, _, _ = row_fit.fit_rows(seen)
    assert robust.shifts(160, 300) == pytest.approx(lies.shifts(160, 300), abs=1e-2)


def test_the_errors_of_a_fit_are_whites_for_weighted_least_squares():
    seen = seen_at(Misalignment(0.5, -0.004, 0.006, 5e-5), noise=0.2)
    found, errors, spread = row_fit.fit_rows(seen)

    x, y = seen.x.astype(float), seen.y.astype(float)
    columns = np.stack([np.ones_like(x), x, y, x * y], axis=1)
    off = seen.shift - columns @ [found.offset, found.rotation, found.scale, found.twist]
    weight = seen.weight / (1 + (off / (1.5 * spread)) ** 2) ** 2
    inverse = np.linalg.inv(columns.T @ (columns * weight[:, None]))
    middle = columns.T @ (columns * ((weight * off) ** 2)[:, None])
    expected = np.sqrt(np.diag(inverse @ middle @ inverse))
    np.testing.assert_allclose(
        [errors.offset, errors.rotation, errors.scale, errors.twist], expected, rtol=0.01
    )
    assert spread == pytest.approx(0.2, rel=0.1)
    best = inverse @ (columns.T @ (weight * seen.shift))
    assert found.shifts(160, 300) == pytest.approx(Misalignment(*best).shifts(160, 300), abs=5e-3)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 10])
def test_the_median_is_numpys(count):
    values = np.random.default_rng(count).normal(size=count)
    assert row_fit._median(values) == pytest.approx(np.median(values))


def test_far_blocks_count_a_quarter_and_less():
    off = np.array([0, 1.5, -1.5, 15]) * 0.4
    np.testing.assert_allclose(row_fit._believed(off, 0.4), [1, 0.25, 0.25, 1 / 101**2])
