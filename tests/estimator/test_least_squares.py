"""Normal equations are solved as least squares are, whatever the units, and without what is missing."""

import numpy as np
import pytest

from rollcli.estimator.least_squares import regular, solve_normal


@pytest.mark.parametrize("missing", [[], [3], [0, 4], [2, 3, 4]])
def test_missing_parameters_are_0_and_units_do_not_matter(missing):
    rng = np.random.default_rng(0)
    design = rng.normal(size=(50, 5)) * [1, 1e4, 1e-5, 1, 1e3]
    design[:, missing] = 0
    d = rng.normal(size=50)
    normal, right = design.T @ design, design.T @ d
    known = [each for each in range(5) if each not in missing]
    expected = np.zeros(5)
    expected[known] = np.linalg.lstsq(design[:, known], d, rcond=None)[0]

    found = solve_normal(normal, right)
    stacked = np.linalg.solve(regular(np.stack([normal, 2 * normal]), 3 * normal), right[:, None])[..., 0]

    np.testing.assert_allclose(found, expected, rtol=1e-7)
    np.testing.assert_allclose(stacked, [expected, expected / 2], rtol=1e-7)


def test_what_two_parameters_tell_together_is_shared_by_them_and_finite():
    x = np.linspace(-1, 1, 20)
    design = np.column_stack([x, x, np.ones(20)])
    normal, right = design.T @ design, design.T @ (3 * x + 5)
    solutions = [
        solve_normal(normal, right),
        np.linalg.solve(regular(normal, normal), right).tolist(),
    ]
    for first, second, level in solutions:
        assert first + second == pytest.approx(3, rel=1e-5)
        assert abs(first) < 10
        assert level == pytest.approx(5, rel=1e-6)
