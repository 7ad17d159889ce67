"""A scene: its light, surfaces and materials."""

from dataclasses import dataclass, field

import numpy as np

from rollcli.simulate.geometry.solids import Solid
from rollcli.simulate.geometry.surfaces import Surface
from rollcli.simulate.geometry.vectors import Array
from rollcli.simulate.looks.materials import Material
from rollcli.simulate.scenes.light import Light

FAR = 180.0  # metres: the ground ends here, at a backdrop of trees


@dataclass
class Scene:
    """The light, surfaces and materials of a scene.

    `cars` are the solids that dim the road below them, `road` is the road's material, and `normal` (3,)
    points upward from the plane that touches the road below the rig.
    """

    light: Light
    normal: Array
    surfaces: list[Surface] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    cars: list[Solid] = field(default_factory=list)
    road: int = 0

    def material(self, look: Material) -> int:
        """Add a material; return its index."""
        self.materials.append(look)
        return len(self.materials) - 1


def draw(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number evenly from `low` to `high`."""
    return float(rng.uniform(low, high))


def draw_offset(rng: np.random.Generator) -> float:
    """Draw the offset at which a material reads its noise, metres, so that no two materials look alike."""
    return draw(rng, 0, 1000)
