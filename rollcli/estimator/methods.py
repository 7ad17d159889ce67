"""What may be asked of the estimator, by name: methods, models, roads and their defaults.

Import-light: the command line reads this module and loads neither NumPy nor a solver.

Add a solver: a file in `solvers` with a `Solver` of the same name, and one line in `SOLVERS`.
Add a method that chooses pixels: a file in `areas` with an `AreaMethod`, and one line in `AREAS`.
"""

import math
from typing import Literal, NamedTuple

LAMBDA0 = 26.0  # the fewest iterations in [GD] Fig. 3
TOLERANCE_DEG = 1e-4  # the finest of the paper's four
MAX_ROLL_DEG = 45.0
MAX_INTERVAL_DEG = 0.75
MAX_ROLL_LIMIT_DEG = 89.0  # a plane of 90 degrees has no finite slope across

LearningRate = float | Literal["auto"]


class Method(NamedTuple):
    """The file that holds a method's function, and what the help says of it."""

    file: str
    summary: str


SOLVERS = {
    "gd": Method("gradient_descent", "gradient descent"),
    "gss": Method("golden_section", "golden section search"),
    "exact": Method("exact", "the global minimum, from polynomial roots"),
}
AREAS = {
    "plane": Method("lower_centre", "one least-squares plane"),
    "areas": Method("iterative", "planes of many small areas"),
}
METHODS = {**SOLVERS, **AREAS}
MODELS = ("parabola", "line")
ROADS = ("auto", "all")


class SolverSettings(NamedTuple):
    """The settings of solvers.

    Attributes
    ----------
    tolerance : float
        delta_theta of the paper, radians; more than 0.
    lambda0 : float or "auto"
        First learning rate of gradient descent, rad^2 per unit of the normalised energy.
    """

    tolerance: float = math.radians(TOLERANCE_DEG)
    lambda0: LearningRate = LAMBDA0


class AreaSettings(NamedTuple):
    """The settings of methods that choose pixels.

    Attributes
    ----------
    max_roll : float
        The largest abs(roll) of a plane that may be road, radians.
    chosen : bool
        Whether the usable pixels are the chosen area already.
    """

    max_roll: float = math.radians(MAX_ROLL_DEG)
    chosen: bool = False


DEFAULT_SOLVER = SolverSettings()
DEFAULT_AREA = AreaSettings()
