"""What may be asked of the estimator, by name, with its defaults; and what is asked, checked.

Import-light: the command line reads this module and loads neither NumPy nor a solver.

Add a solver: a file in `solvers` with a `Solver`, and one line in `SOLVERS`.
Add a method that chooses pixels: an `AreaMethod` in ``solvers/areas.py``, and one line in `AREAS`.
"""

import math
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, NamedTuple

from rollcli.errors import UsageError
from rollcli.estimator.tuning import TUNING, Tuning

LAMBDA0 = 26.0  # the fewest iterations in [GD] Fig. 3
TOLERANCE_DEG = 1e-4  # the finest of the paper's four
MAX_ROLL_DEG = 45.0
MAX_INTERVAL_DEG = 0.75
MAX_ROLL_LIMIT_DEG = 89.0  # a plane of 90 degrees has no finite slope across

LearningRate = float | Literal["auto"]


class Method(NamedTuple):
    """Where in `solvers` a method's function is, and what the help says of it."""

    function: str
    summary: str

    def load(self) -> Any:
        """Return its function, a `Solver` or an `AreaMethod`."""
        module, function = self.function.split(".")
        return getattr(import_module(f"rollcli.estimator.solvers.{module}"), function)


SOLVERS = {
    "gd": Method("gradient_descent.gradient_descent", "gradient descent"),
    "gss": Method("golden_section.golden_section", "golden section search"),
    "exact": Method("exact.exact", "the global minimum, from polynomial roots"),
}
AREAS = {
    "plane": Method("areas.lower_centre", "one least-squares plane"),
    "areas": Method("areas.iterative", "planes of many small areas"),
}
METHODS = {**SOLVERS, **AREAS}
MODELS = ("parabola", "line")
ROADS = ("auto", "all")


@dataclass(frozen=True)
class Request:
    """How a map is to be estimated.

    Attributes
    ----------
    method : str
        One of `METHODS`.
    model : str
        Of the road: one of `MODELS`.
    road : str
        "auto": find the road first; "all": use every valid pixel as the paper does.
    lambda0 : float or "auto"
        First learning rate of gradient descent, rad^2 per unit of the normalised energy.
    tolerance : float
        delta_theta of the paper, radians; more than 0.
    max_roll : float
        The largest abs(roll) that road finding considers, and of a plane that may be road, radians.
    max_interval : float
        Half-width of the 95 % interval above which an angle is doubted, radians; so is one of which noise
        and misfit alone make more than 0.45 times that.
    slope_error : float
        Standard deviation of a slope along the rows, px per px, that all disparities may have beside the
        road's: what is left of it where the views of a pair were levelled (`StereoMatch.slope_error`).
    seed : int
        Of road finding.
    middle : tuple of float, or None
        Column and row that look straight ahead, px: the principal point, which a crop moves away from the
        middle of the map. None: that middle.
    doffs : float
        What is added to disparities so that they are 0 infinitely far away, px: that of a calibration.
    aspect : float
        fy / fx of a calibration; more than 0. What lies to the side of the lane is that of the rig.
    tuning : Tuning
        The estimator's tuned numbers; to study what they do.

    Raises
    ------
    UsageError
        When a value is out of range; of a calibration's, `Calibration` tells.
    """

    method: str = "gd"
    model: str = "parabola"
    road: str = "auto"
    lambda0: LearningRate = LAMBDA0
    tolerance: float = math.radians(TOLERANCE_DEG)
    max_roll: float = math.radians(MAX_ROLL_DEG)
    max_interval: float = math.radians(MAX_INTERVAL_DEG)
    slope_error: float = 0.0
    seed: int = 0
    middle: tuple[float, float] | None = None
    doffs: float = 0.0
    aspect: float = 1.0
    tuning: Tuning = TUNING

    def __post_init__(self) -> None:
        for kind, names in (("method", METHODS), ("model", MODELS), ("road", ROADS)):
            if getattr(self, kind) not in names:
                raise UsageError(f"{kind} {getattr(self, kind)!r}: choose one of {', '.join(names)}")
        if self.lambda0 != "auto" and not 0 < self.lambda0 < math.inf:
            raise UsageError(f"lambda0 {self.lambda0}: give a positive number, or auto")
        if not 0 < self.tolerance < math.inf:
            raise UsageError(
                f"a tolerance of {math.degrees(self.tolerance):g} degrees: give a positive angle"
            )
        if not 0 < self.max_roll <= math.radians(MAX_ROLL_LIMIT_DEG) * (1 + 1e-12):
            raise UsageError(
                f"a largest roll of {math.degrees(self.max_roll):g} degrees: "
                f"give more than 0, at most {MAX_ROLL_LIMIT_DEG:g}"
            )
        if not 0 <= self.slope_error < math.inf:
            raise UsageError(f"a slope error of {self.slope_error:g}: give 0 or more px per px")
        if self.seed < 0:
            raise UsageError(f"seed {self.seed}: give 0 or a larger whole number")
        if not self.max_interval > 0:
            raise UsageError(
                f"a widest interval of {math.degrees(self.max_interval):g} degrees: give a positive angle"
            )

    @property
    def parabolic(self) -> bool:
        """Whether the road is a parabola, not a line."""
        return self.model == "parabola"

    @property
    def max_tangent(self) -> float:
        """Tangent of the largest roll, in the map's pixels."""
        return self.aspect * math.tan(self.max_roll)


DEFAULT_REQUEST = Request()
