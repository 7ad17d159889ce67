"""Shade the points that rays hit."""

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.geometry.vectors import Array, groups
from rollcli.simulate.looks.materials import Material
from rollcli.simulate.looks.texture import Values
from rollcli.simulate.scenes.light import sky
from rollcli.simulate.scenes.scene import Scene
from rollcli.simulate.views.trace import AIR, LONG, NONE, SHORT, SUN, P, Q

_MAX_TAPS = 8


def shade(scene: Scene, direction: Array, kinds: NDArray[np.int16], reads: Values) -> Values:
    """Return the light (N, 3) of rays in `direction` (3, N); `kinds` are materials, `reads` as in `Hits`."""
    light = np.empty((len(kinds), 3), np.float32)
    nothing = kinds == NONE
    light[nothing] = sky(scene.light, direction[:, nothing])
    ambient = np.float32(scene.light.ambient)
    strength = np.float32(scene.light.exposure) * (ambient * reads[AIR] + (1 - ambient) * reads[SUN])
    for k, at in groups(kinds, len(scene.materials)):
        material, mine = scene.materials[k], reads[: SHORT + 1].take(at, axis=1)
        bright = _albedo(material, mine) * strength[at]
        light[at] = bright[:, None] * material.colour(mine[P], mine[Q])
    return light


def _albedo(material: Material, reads: Values) -> Values:
    """Average the albedo over each pixel's footprint: taps along its long axis, as wide as its short one."""
    albedo = np.empty(reads.shape[1], np.float32)
    power = np.ceil(np.log2(np.clip(reads[LONG] / reads[SHORT], 1, _MAX_TAPS)) - 0.5).astype(np.int16)
    for k, at in groups(power, power.max() + 1):
        p, q, long_p, long_q, long, short = reads.take(at, axis=1)
        taps = 1 << k
        steps = (((np.arange(taps) + 0.5) / taps - 0.5)[:, None]).astype(np.float32)
        width = np.tile(np.maximum(short, long / np.float32(taps)), taps)
        values = material.albedo((p + steps * long_p).ravel(), (q + steps * long_q).ravel(), width)
        albedo[at] = values.reshape(taps, -1).mean(axis=0)
    return albedo
