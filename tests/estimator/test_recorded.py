"""Estimates are those that this version is known to give; see `tests.recorded`."""

import math

import numpy as np

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.request import METHODS
from rollcli.simulate.options import SCENES
from rollcli.simulate.spec import FrameSpec
from tests.estimator.synthetic_maps import bent_road, flat_road
from tests.estimator.test_doubts import MAPS
from tests.recorded import unlike_record
from tests.true_disparity import true_disparity

# of maps that have no road, or no noise at all, the last digit of a sum decides what is found
LAST_DIGIT = (
    "no convergence within the iterations allowed",
    "the disparity grows upward",
    "the road's pixels moved the roll",
)


def rendered(scene, number):
    """A rendered map with the noise, the holes and the wrong matches of a matcher, (240, 320), px."""
    rng = np.random.default_rng(number)
    spec = FrameSpec(
        scene=scene,
        roll=rng.uniform(-0.3, 0.3),
        pitch=rng.uniform(0, 0.12),
        curvature=(0, 0.002, -0.002)[number % 3],
        cross_section=("flat", "crowned")[number % 2],
        crossfall=0.03 * (number % 2),
        size=(320, 240),
        focal=280.0,
        seed=number,
    )
    disparity = true_disparity(spec)[0]
    coarse = rng.normal(0, 0.1, (30, 40)).repeat(8, 0).repeat(8, 1)
    noisy = disparity + coarse + rng.normal(0, 0.1 * (number % 4), disparity.shape)
    wrong = rng.random(disparity.shape) < 0.05
    noisy[wrong] = rng.uniform(0, 60, wrong.sum())
    lost = (rng.random((15, 20)) < 0.15).repeat(16, 0).repeat(16, 1) | (disparity <= 0)
    return np.where(lost, 0, np.maximum(noisy, 0.01))


def found(disparity, **options):
    """All that an estimate says of a map."""
    try:
        estimate = estimate_roll(disparity, road_mask=True, **options)
    except EstimationError as error:
        return str(error)
    rows, columns = np.nonzero(estimate.road_mask)
    road = [float(rows.mean()), float(columns.mean())]
    tangent = estimate.tangent
    return {
        **estimate.to_dict(),
        "tangent": [tangent.theta, tangent.row, tangent.disparity, tangent.slope],
        "road": road,
    }


def results():
    """Estimates by the name of their map."""
    here = {
        f"{scene} {number}": found(rendered(scene, number)) for scene in SCENES[:4] for number in range(6)
    }
    street = rendered("street", 3)
    for method in METHODS:
        for model in ("parabola", "line"):
            here[f"{method} {model}"] = found(street, method=method, model=model)
        here[f"{method} all"] = found(bent_road(7, noise=0.3), method=method, road="all")
        noise = np.random.default_rng(5).uniform(1, 9, (30, 40))
        here[f"{method} noise"] = found(noise, method=method, road="all")
    below = np.arange(240)[:, None] > np.full(320, 150)
    here["mask"] = found(street, mask=below)
    here["rounded"] = found(np.round(street))
    here["slope error"] = found(street, slope_error=0.001)
    here["other seed"] = found(street, seed=8)
    here["narrow interval"] = found(street, max_interval=math.radians(0.05))
    here["learning rate"] = found(street, lambda0="auto", tolerance=1e-4)
    here["few pixels"] = found(np.where(np.random.default_rng(1).random(street.shape) < 0.01, street, 0))
    here["level"] = found(np.full((60, 80), 7.0))
    for roll_deg in (-80, -40, 60, 85):
        here[f"turned {roll_deg}"] = found(flat_road(roll_deg), max_roll=math.radians(89))
    for reason, (make, options) in MAPS.items():
        if reason not in LAST_DIGIT:
            here[reason] = found(make(), **options)
    return here


def test_estimates_are_those_on_record():
    assert unlike_record("estimator", results(), 1e-4) == []
