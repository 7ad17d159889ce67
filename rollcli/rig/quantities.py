"""What is assessed of a rig, with columns and units: roll, pitch, height, how views lie. Import-light."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number that describes how the rig is mounted.

    Attributes
    ----------
    name : str
        As people call it.
    column, ci_column : str
        Of a result: the value, and the half-width of its 95 % interval, empty where frames have none.
    unit : str
        What follows a number, such as "°" or " m".
    suffix : str
        What names end in, such as "deg" or "m".
    scale : float
        What of it is as much as a degree of an angle.
    period : float
        After which it is the same again.
    """

    name: str
    column: str
    ci_column: str
    unit: str
    suffix: str
    scale: float = 1.0
    period: float = math.inf


ROLL = Quantity("roll", "roll_deg", "roll_ci95_deg", "°", "deg", period=180.0)
PITCH = Quantity("pitch", "pitch_deg", "pitch_ci95_deg", "°", "deg")
HEIGHT = Quantity("height", "height_m", "height_ci95_m", " m", "m", 0.1)
QUANTITIES = (ROLL, PITCH, HEIGHT)
# how the right view of a pair lies
ALIGNMENT = (
    Quantity("right_lower", "right_lower_px", "", " px", "px", 0.2),
    Quantity("right_clockwise", "right_clockwise_deg", "", "°", "deg", 0.1),
    Quantity("right_larger", "right_larger_percent", "", " %", "percent", 0.1),
    Quantity("right_twist", "right_twist_px", "", " px", "px", 0.2),
)
SIZE = ("width", "height")
# of columns; what lies outside is another program's idea of a roll
BOUNDS = {
    "roll_deg": (-90.0, 90.0),
    "image_roll_deg": (-90.0, 90.0),
    **{each.ci_column: (0.0, math.inf) for each in QUANTITIES},
    "pitch_deg": (-90.0, 90.0),
    "height_m": (0.0, math.inf),
}
COLUMNS = (
    *(name for each in (*QUANTITIES, *ALIGNMENT) for name in (each.column, each.ci_column) if name),
    *SIZE,  # frames of several sizes are several drives
)
