"""Turn light into the grey levels of a sensor."""

import numpy as np
from numpy.typing import NDArray

from rollcli.simulate.geometry.vectors import dot
from rollcli.simulate.looks.texture import Values

_GREY = np.array([0.114, 0.587, 0.299], np.float32)  # BT.601, as OpenCV's grey


def expose(
    light: Values, noise: float, gain: float, colour: bool, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Apply vignetting, gamma and noise, and quantise to eight bits: (H, W, 3), or (H, W) when not in colour.

    `light` is (H, W, 3), 1 at saturation; `noise` in grey levels; `gain` multiplies the brightness.
    """
    height, width = light.shape[:2]
    v, u = np.ogrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    falloff = (gain * (1 - 0.12 * (u * u + v * v))).astype(np.float32)
    image = light * falloff[..., None] if colour else dot(_GREY, np.moveaxis(light, -1, 0)) * falloff
    grey = np.float32(255) * np.sqrt(image)  # a gamma of 2
    grey += np.float32(noise) * rng.standard_normal(grey.shape, np.float32)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)
