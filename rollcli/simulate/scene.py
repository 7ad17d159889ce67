"""A scene: its light, surfaces and materials."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.materials import Material, Values, coarse
from rollcli.simulate.solids import Solid
from rollcli.simulate.surfaces import Surface
from rollcli.simulate.vectors import Array, dots

OVERCAST = 0.6


@dataclass(frozen=True)
class Light:
    """The direction to the sun (3,), the share of ambient light, the exposure, and an offset of the clouds.

    Under an overcast sky (`ambient` of `OVERCAST` or more) nothing casts a shadow.
    """

    sun: Array
    ambient: float
    exposure: float
    clouds: float


def draw_light(rng: np.random.Generator) -> Light:
    """Draw the light; on average every second scene has sun."""
    height, azimuth = rng.uniform(0.45, 1.2), rng.uniform(-np.pi, np.pi)
    sun = np.array([np.cos(height) * np.sin(azimuth), np.sin(height), np.cos(height) * np.cos(azimuth)])
    ambient = rng.uniform(0.28, 0.45) if rng.random() < 0.5 else rng.uniform(0.7, 0.9)
    return Light(sun, float(ambient), float(rng.uniform(1.2, 1.6)), float(rng.uniform(0, 1000)))


def in_shadow(points: Array, sun: Array, casters: Sequence[Surface]) -> NDArray[np.bool_]:
    """Tell which of the points (3, N) have a caster between them and the sun."""
    shadow = np.zeros(points.shape[1], bool)
    # projected along the sun's rays, a caster covers the points within its outline
    across = np.cross(sun, [0.0, 1.0, 0.0])
    axes = np.array([across / np.linalg.norm(across), np.cross(across, sun) / np.linalg.norm(across)])
    projected = dots(axes, points)
    for caster in casters:
        corners = caster.bounds()
        inside = ~shadow
        if corners is not None:
            outline = dots(axes, corners)
            for place, low, high in zip(projected, outline.min(axis=1), outline.max(axis=1), strict=True):
                inside &= (place > low) & (place < high)
        at = np.flatnonzero(inside)
        if len(at):
            toward = np.broadcast_to(sun[:, None], (3, len(at)))
            shadow[at] = np.isfinite(caster.intersect(points[:, at], toward))
    return shadow


def air_below(points: Array, car: Solid) -> Values:
    """Return the share of the sky's light that reaches ground points (3, N) near and below a car."""
    right, _, ahead = dots(car.frame, points - car.place[:, None])
    across, _, along = car.extent
    beside = np.maximum(np.maximum(across[0] - right, right - across[1]) + 0.2, 0)
    beyond = np.maximum(np.maximum(along[0] - ahead, ahead - along[1]) + 0.2, 0)
    return np.asarray(1 - 0.85 * np.exp(-(beside**2 + beyond**2) / 0.35**2), np.float32)


def sky(light: Light, direction: Array) -> Values:
    """Return the sky's colour (N, 3) in directions (3, N): pale at the horizon, with clouds."""
    x, y, z = (direction / np.linalg.norm(direction, axis=0)).astype(np.float32)
    rise = np.clip(y, 0, 1)
    flat = np.float32(60) / (rise + np.float32(0.15))
    noise = coarse(x * flat, z * flat, np.full_like(x, 0.5), light.clouds)
    cloud = np.clip(0.5 + 0.5 * noise, 0, 1) * np.sqrt(rise)
    clear, pale = np.array([1.0, 0.80, 0.62], np.float32), np.array([0.98, 0.95, 0.92], np.float32)
    mix = np.minimum(np.maximum(1 - 1.6 * rise, 0) + 0.8 * cloud, 1)[:, None]
    return np.asarray(clear + mix * (pale - clear), np.float32)


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
