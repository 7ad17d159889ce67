"""The solvers on real road pairs; see the README of that folder for what is known of them."""

import functools
import math

import pytest

from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import Request
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from rollcli.files.formats import read_image
from rollcli.stereo.match import StereoOptions, match_pair
from tests.estimator.synthetic_maps import energy_of
from tests.real_pairs import ROADS, ROLL_DEG, needs_roads

HALF_SIZE = StereoOptions(num_disparities=256, block_size=5, mode="3way", downscale=2)
DELTAS = [math.pi / k for k in (1.8e3, 1.8e4, 1.8e5, 1.8e6)]
PAPER = [3, 4, 4, 4]  # [GD] Table I, iterations of gradient descent

pytestmark = needs_roads


@functools.cache
def disparity_of(stem):
    left, right = ROADS / "left" / f"{stem}.png", ROADS / "right" / f"{stem.replace('L', 'R')}.png"
    return match_pair(read_image(left), read_image(right), HALF_SIZE).disparity


@pytest.fixture(params=ROLL_DEG)
def stem(request):
    return request.param


def test_gradient_descent_converges_within_6_iterations_to_the_known_angle(stem):
    found = estimate_roll(disparity_of(stem), Request(road="all"))
    assert found.converged
    assert found.global_minimum
    assert found.iterations <= 6
    assert math.degrees(found.theta) == pytest.approx(ROLL_DEG[stem], abs=0.15)


def test_gradient_descents_iterations_are_within_one_of_the_papers(stem):
    energy = energy_of(disparity_of(stem))
    counts = [gradient_descent(energy, Request(tolerance=delta)).iterations for delta in DELTAS]
    assert all(abs(count - paper) <= 1 for count, paper in zip(counts, PAPER, strict=True)), counts


def test_agreeing_areas_give_the_angle_of_a_robust_fit(stem):
    found = estimate_roll(disparity_of(stem), Request(method="areas", road="all"))
    robust = {"m1_L1": -3.41, "m1_L5": -1.53, "m2_L9": -2.53, "m2_L18": -4.27, "m3_L3": 2.39}[stem]
    assert math.degrees(found.theta) == pytest.approx(robust, abs=0.1)
