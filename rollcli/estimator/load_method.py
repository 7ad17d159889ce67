"""Load the function of a method by its name, and no other method with it."""

from functools import cache
from importlib import import_module
from typing import Any

from rollcli.estimator.areas.plane import AreaMethod
from rollcli.estimator.methods import AREAS, SOLVERS, Method
from rollcli.estimator.solvers.solution import Solver


def load_solver(name: str) -> Solver:
    """Return the function of a solver."""
    solver: Solver = _load("solvers", SOLVERS[name])
    return solver


def load_area_method(name: str) -> AreaMethod:
    """Return the function of a method that chooses pixels."""
    method: AreaMethod = _load("areas", AREAS[name])
    return method


@cache
def _load(folder: str, method: Method) -> Any:
    return getattr(import_module(f"rollcli.estimator.{folder}.{method.file}"), method.file)
