"""A scene: light, surfaces and what they look like."""

from dataclasses import dataclass, field

import numpy as np

from rollcli.simulate.light import Light
from rollcli.simulate.materials import Material
from rollcli.simulate.solids import Solid
from rollcli.simulate.surfaces import Surface
from rollcli.simulate.vectors import Array

FAR = 180.0  # metres: where the ground ends before a backdrop of trees


@dataclass
class Scene:
    """What there is to see.

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
        """Add a material; its index."""
        self.materials.append(look)
        return len(self.materials) - 1


def draw(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between two."""
    return float(rng.uniform(low, high))


def draw_offset(rng: np.random.Generator) -> float:
    """Where a material reads the noise, metres: no two materials look alike."""
    return draw(rng, 0, 1000)
