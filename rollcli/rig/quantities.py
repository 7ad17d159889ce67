"""What is assessed of a rig: roll, pitch and height, with their columns and units. Import-light."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number that describes how the rig is mounted.

    Attributes
    ----------
    name : str
        As people call it.
    column, ci_column : str
        Of a result: the value, and the half-width of its 95 % interval.
    unit : str
        What follows a number: "°" or " m".
    suffix : str
        What names end in: "deg" or "m".
    """

    name: str
    column: str
    ci_column: str
    unit: str
    suffix: str


ROLL = Quantity("roll", "roll_deg", "roll_ci95_deg", "°", "deg")
PITCH = Quantity("pitch", "pitch_deg", "pitch_ci95_deg", "°", "deg")
HEIGHT = Quantity("height", "height_m", "height_ci95_m", " m", "m")
QUANTITIES = (ROLL, PITCH, HEIGHT)
COLUMNS = tuple(name for each in QUANTITIES for name in (each.column, each.ci_column))
