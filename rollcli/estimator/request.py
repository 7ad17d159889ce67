"""What is asked of the estimator, checked."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from rollcli.errors import UsageError
from rollcli.estimator.methods import MAX_ROLL_LIMIT_DEG, METHODS, MODELS, ROADS, SolverSettings
from rollcli.estimator.tuning import Tuning


@dataclass(frozen=True)
class Request:
    """How a map is to be estimated; see `estimate_roll` for each field.

    Raises
    ------
    UsageError
        When a value is out of range.
    """

    method: str
    model: str
    road: str
    solver: SolverSettings
    max_roll: float
    max_interval: float
    slope_error: float
    seed: int
    tuning: Tuning

    def __post_init__(self) -> None:
        _check_name("method", self.method, METHODS)
        _check_name("model", self.model, MODELS)
        _check_name("road", self.road, ROADS)
        lambda0, tolerance = self.solver.lambda0, self.solver.tolerance
        if lambda0 != "auto" and not 0 < lambda0 < math.inf:
            raise UsageError(f"lambda0 {lambda0}: give a positive number, or auto")
        if not tolerance > 0:
            raise UsageError(f"a tolerance of {math.degrees(tolerance):g} degrees: give a positive angle")
        if not 0 < self.max_roll <= math.radians(MAX_ROLL_LIMIT_DEG) * (1 + 1e-12):
            raise UsageError(
                f"a largest roll of {math.degrees(self.max_roll):g} degrees: "
                f"give more than 0, at most {MAX_ROLL_LIMIT_DEG:g}"
            )

        if not 0 <= self.slope_error < math.inf:
            raise UsageError(f"a slope error of {self.slope_error:g}: give 0 or more px per px")
        if not self.max_interval > 0:
            raise UsageError(
                f"a widest interval of {math.degrees(self.max_interval):g} degrees: give a positive angle"
            )

    @property
    def parabolic(self) -> bool:
        """Whether the road is a parabola, not a line."""
        return self.model == "parabola"


def _check_name(kind: str, name: str, names: Collection[str]) -> None:
    if name not in names:
        raise UsageError(f"{kind} {name!r}: choose one of {', '.join(names)}")
