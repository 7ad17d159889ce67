"""What the estimator finds in maps of every kind, to the digit; see `tests.recorded`."""

import math
from functools import partial

import numpy as np

from rollcli.errors import EstimationError
from rollcli.estimator.estimate import estimate_roll
from rollcli.estimator.moments import CheckedMap
from rollcli.estimator.request import AREAS, LAMBDA0, Request
from rollcli.estimator.road.find import road_plane
from rollcli.estimator.road.pixels import select_pixels
from rollcli.estimator.solvers.exact import minima
from rollcli.estimator.solvers.golden_section import golden_section
from rollcli.estimator.solvers.gradient_descent import gradient_descent
from tests.estimator.synthetic_maps import bent_road, energy_of, flat_road
from tests.recorded import made, recorded_test

WIDTH, HEIGHT = 240, 160
_road = partial(flat_road, width=WIDTH, height=HEIGHT)


def _noise(sd, seed=0):
    return np.random.default_rng(seed).normal(0, sd, (HEIGHT, WIDTH))


def _across():
    """Columns from the middle of the map."""
    return np.arange(WIDTH) - (WIDTH - 1) / 2


def _noisy(roll_deg, sd=0.3, **options):
    road = _road(roll_deg, **options)
    return np.where(road > 0, road + _noise(sd), 0)


def _holes():
    found = _noisy(-7, 0.2)
    found[np.random.default_rng(1).random(found.shape) < 0.4] = 0
    found[90:130, 100:190] = np.nan
    return found


def _traffic():
    found = _noisy(3, 0.2)
    for top, left, disparity in ((60, 30, 12.0), (70, 100, 16.5), (75, 190, 22.0), (50, 140, 7.0)):
        found[top : top + 50, left : left + 40] = disparity + _noise(0.1, left)[:50, :40]
    return found


def _walls(near=2.0):
    return np.maximum(_noisy(-2, 0.15), 0.3 * np.abs(_across()) / near)


def _tree():
    found = _noisy(4, 0.2)
    wild = np.random.default_rng(3).random(found.shape) < 0.6
    found[wild] = np.random.default_rng(4).uniform(1, 25, wild.sum())
    return found


def _crowned(camber=0.06):
    found = _road(6)
    return np.where(found > 0, found * (1 - camber * (_across() / 90) ** 2) + _noise(0.1), 0)


def _sweep():
    found = _noisy(2, 0.1)
    found[np.arange(HEIGHT) % 4 != 0] = 0
    return found


def _kerb():
    found = _noisy(-4, 0.1)
    return np.where(_across() > 25, 0.85 * found, found)


MAPS = {
    "clean": lambda: _road(5),
    "level": lambda: _road(0),
    "noisy": lambda: _noisy(-11),
    "holes": _holes,
    "curved": lambda: bent_road(4, width=WIDTH, height=HEIGHT, bend=0.001, noise=0.3, seed=5),
    "traffic": _traffic,
    "walls": _walls,
    "canyon": lambda: _walls(0.9),
    "tree": _tree,
    "crowned": _crowned,
    "dished": lambda: _crowned(-0.12),
    "two roads": lambda: np.where(_across() < 0, _noisy(8, 0.1), _noisy(-8, 0.1)),
    "sweep": _sweep,
    "kerb": _kerb,
    "very noisy": lambda: _noisy(9, 1.5),
    "hardly a road": lambda: np.abs(_noisy(9, 9.0)),
    "large roll": lambda: _noisy(38, 0.2),
    "looking down": lambda: _noisy(-3, 0.2, pitch_deg=40),
    "looking up": lambda: _noisy(-3, 0.2, pitch_deg=-10),
    "table": lambda: _noisy(3, 0.2, pitch_deg=25, focal=900.0),
    "room": lambda: _noisy(3, 0.1, pitch_deg=30, focal=330.0),
    "whole pixels": lambda: _road(-6).round().astype(np.uint16),
    "scaled": lambda: 16.0 * _noisy(7, 0.1),
    "faint": lambda: 0.01 * _noisy(7, 0.1),
    "wall": lambda: 20 + _noise(0.2),
    "depth": lambda: 30 - _noisy(5, 0.2),
    "nothing but noise": lambda: np.random.default_rng(8).uniform(1, 30, (HEIGHT, WIDTH)),
    "few pixels": lambda: bent_road(5, width=12, height=9, noise=0.2),
    "narrow": lambda: bent_road(-5, width=24, height=160, noise=0.2),
    "flat strip": lambda: bent_road(-5, width=200, height=20, noise=0.2),
    "wide": lambda: _noisy(3, 0.4, focal=70.0),
}
OTHER = {  # a map, and how it is estimated
    "line": ("curved", {"model": "line"}),
    "all of noisy": ("noisy", {"road": "all"}),
    "all of traffic": ("traffic", {"road": "all"}),
    "all of noise": ("nothing but noise", {"road": "all"}),
    "all of depth": ("depth", {"road": "all", "model": "line"}),
    "all of few": ("few pixels", {"road": "all"}),
    "golden section": ("walls", {"method": "gss", "tolerance": 1e-3}),
    "exact": ("walls", {"method": "exact"}),
    "plane": ("walls", {"method": "plane"}),
    "areas": ("traffic", {"method": "areas"}),
    "areas of holes": ("holes", {"method": "areas", "max_roll": 0.2}),
    "areas of faint": ("faint", {"method": "areas"}),
    "chosen plane": ("holes", {"method": "plane", "road": "all"}),
    "chosen areas": ("noisy", {"method": "areas", "road": "all"}),
    "at the bound": ("large roll", {"max_roll": math.radians(30)}),
    "within the bound": ("noisy", {"max_roll": math.radians(12), "seed": 5}),
    "large step": ("traffic", {"lambda0": 500.0, "road": "all"}),
    "small step": ("clean", {"lambda0": 0.5, "tolerance": 1e-5}),
    "own step": ("crowned", {"lambda0": "auto"}),
    "levelled": ("noisy", {"slope_error": 0.004}),
    "strict": ("noisy", {"max_interval": 0.001}),
    "masked": ("traffic", {"mask": np.add.outer(np.zeros(HEIGHT), _across()) < 20}),
}


def _estimate(name, mask=None, **asked):
    """The estimate, the road behind it and its pixels; or why there is none."""
    disparity = MAPS[name]()
    try:
        found = estimate_roll(disparity, Request(**asked), mask=mask, road_mask=True)
    except EstimationError as error:
        return str(error)
    tangent = found.tangent and [found.tangent.row, found.tangent.disparity, found.tangent.slope]
    return {**found.to_dict(), "tangent": tangent, "mask": found.road_mask}


def _behind(name):
    """What the estimate rests on: the plane that was found, its rivals, and the surface fitted to it."""
    try:
        pixels = select_pixels(CheckedMap.of(MAPS[name](), None), Request(seed=1))
    except EstimationError as error:
        return str(error)
    road, surface = pixels.road, pixels.surface
    return {
        "road": road and {"score": road.score, "rival": road.rival, "horizon": road.horizon},
        "surface": surface and {"moved": surface.moved, "alpha": surface.model.alpha},
        "plane": road_plane(MAPS[name]()),
    }


def _solved(name):
    disparity = MAPS[name]()
    energy = energy_of(disparity)
    settings = [
        Request(tolerance=tolerance, lambda0=rate)
        for tolerance, rate in ((1e-3, LAMBDA0), (1e-5, 2.0), (1e-4, "auto"))
    ]
    return {
        "minima": minima(energy),
        "descent": [gradient_descent(energy, each) for each in settings],
        "section": [golden_section(energy, each) for each in settings],
        "parabola": [energy.parabola(theta) for theta in (-1.2, 0.0, 0.3)],
        "areas": [
            _chosen(AREAS[method].load()(disparity, disparity > 0, *area))
            for method in ("plane", "areas")
            for area in ((Request(), False), (Request(max_roll=0.3), True))
        ],
    }


def _chosen(fit):
    return {"used": fit.used, "iterations": fit.solution.iterations, "status": fit.solution.status}


ASKED = (
    *({"max_roll": math.radians(roll_deg)} for roll_deg in (0, -5, 89.001, math.nan)),
    *({name: "magic"} for name in ("method", "model", "road")),
    *({"lambda0": step} for step in (0.0, math.inf)),
    *({name: angle} for name in ("tolerance", "max_interval") for angle in (0.0, math.inf, math.nan)),
    *({"slope_error": each} for each in (-1e-4, math.nan, math.inf)),
    {"seed": -1},
    {"mask": np.ones((4, 5))},
    {"max_roll": math.radians(89), "max_interval": 1e-9, "lambda0": 1e-9, "tolerance": 1e-300},
)
NO_MAPS = (np.ones(50), np.ones((5, 5, 3)), np.full((50, 50), "1"), _road(5) * 1e-20, _road(5) * 1e13)


def _angle(disparity, mask=None, **asked):
    return estimate_roll(disparity, Request(**asked), mask=mask).roll_deg


def _asked():
    """Which options are taken, and why others and what is no map are not."""
    found = [made(_angle, _road(5), **options) for options in ASKED]
    return found + [made(_angle, each) for each in NO_MAPS]


CASES = {
    "asked": _asked,
    **{name: partial(_estimate, name) for name in MAPS},
    **{name: partial(_estimate, given, **options) for name, (given, options) in OTHER.items()},
    **{
        f"behind {name}": partial(_behind, name) for name in ("traffic", "walls", "tree", "two roads", "room")
    },
    **{f"solved {name}": partial(_solved, name) for name in ("curved", "nothing but noise")},
}

# sums of single precision depend on the processor's BLAS, and with them which pixels are road
test_answers_are_those_recorded = recorded_test("estimator", CASES, rel=2e-4, least=2e-4)
