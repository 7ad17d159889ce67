"""Frames that are far off those beside them."""

import numpy as np
import pytest

from rollcli.rig.drive.quantity import gross_outliers
from tests.rig.drive.series import drive


@pytest.mark.parametrize(("phi", "sd"), [(0.9, 0.4), (0.97, 0.1), (0.94, 0.3)])
def test_gross_outliers_are_found_and_good_frames_are_not_called_so(phi, sd):
    values, errors = drive(5, 3000, phi=phi, sd=sd)
    assert gross_outliers(values, errors**2).sum() <= 3
    rng = np.random.default_rng(6)
    bad = rng.random(3000) < 0.05
    values[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(5, 30, bad.sum())
    found = gross_outliers(values, errors**2)
    assert found[bad].all()
    assert found[~bad].mean() < 0.01


def test_a_jump_is_no_gross_outlier():
    values = np.repeat([0.0, 5.0], 100) + np.random.default_rng(0).normal(0, 0.1, 200)
    assert not gross_outliers(values, np.full(200, 0.01)).any()


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 1.0, 1.0], [0.0] * 50])
def test_few_or_equal_values_have_no_outliers(values):
    assert not gross_outliers(np.array(values), np.full(len(values), 0.01)).any()
