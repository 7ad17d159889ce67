"""Rough roads: unevenness by the classes of ISO 8608, mended patches, and a lane that sinks in its tracks.

[ISO]: ISO 8608, "Mechanical vibration - Road surface profiles": the density of a profile's heights is
G(n0) (n / n0)^-2 over the waves' number per metre n, G(n0) four times as large from class to class.
[Isotropy]: Kamash, Robson, "The application of isotropy in road surface modelling", J. Sound and Vibration
57(1), 1978: a surface has such profiles in all directions, which tells how alike its two tracks are.
"""

import math

import numpy as np

from rollcli.simulate.lane import lane_plane
from rollcli.simulate.options import ROUGHNESS
from rollcli.simulate.relief import Relief
from rollcli.simulate.vectors import Array

_REFERENCE = 0.1  # waves per metre: n0 of [ISO]
_SMOOTHEST = 16e-6  # m^3: G(n0) of class A, the geometric mean of its bounds
_WAVES = 0.011, 2.83  # waves per metre: the range of [ISO]
_STEP = 0.125  # metres: 2.8 nodes for the shortest wave
_LEFT, _START = -32.0, -8.0  # metres
_ACROSS, _ALONG = 512, 2048  # nodes: 64 by 256 metres
_SUNKEN = 0.003  # metres: the deepest track, and the highest patch, of class A
_TRACK = 0.22  # metres: standard deviation of a track's depth across
_MOST_PATCHES = 4


def draw_relief(
    rng: np.random.Generator, roughness: str, edges: tuple[float, float], wheels: tuple[float, float]
) -> Relief:
    """Draw the unevenness of a road.

    Parameters
    ----------
    rng : numpy.random.Generator
    roughness : str
        One of `ROUGHNESS`.
    edges : tuple of float
        Of the carriageway, lateral, metres.
    wheels : tuple of float
        Lateral positions of the lane's two tracks, metres.

    Returns
    -------
    Relief
        At a height of 0 below the rig, on the plane that fits the lane ahead (`lane_plane`).
    """
    scale = 2.0 ** ROUGHNESS.index(roughness)  # of heights, whose squares are four times as large
    lateral, z = _LEFT + _STEP * np.arange(_ACROSS), _START + _STEP * np.arange(_ALONG)
    heights = scale * _random_field(rng)
    for wheel in wheels:
        depth = rng.uniform(0, scale * _SUNKEN)
        heights -= depth * np.exp(-np.square((lateral - wheel) / _TRACK) / 2)
    for _ in range(rng.integers(_MOST_PATCHES + 1)):
        x, ahead = rng.uniform(*edges), rng.uniform(3, 40)
        wide, long, raised = rng.uniform(0.5, 2.0), rng.uniform(0.8, 6.0), rng.uniform(-1, 1)
        across = (lateral >= x) & (lateral < min(x + wide, edges[1]))
        heights[np.ix_((z >= ahead) & (z < ahead + long), across)] += scale * _SUNKEN * raised
    relief = Relief(heights, _LEFT, _START, _STEP)
    heights -= lane_plane(relief)[0]
    return relief


def _random_field(rng: np.random.Generator) -> Array:
    """Draw heights (rows, columns) of class A, whose profiles have the same density in all directions."""
    along, across = np.fft.fftfreq(_ALONG, _STEP)[:, None], np.fft.rfftfreq(_ACROSS, _STEP)
    waves = np.hypot(along, across)
    within = (waves >= _WAVES[0]) & (waves <= _WAVES[1])
    # a density A n^-3 over the plane has profiles of 2 A n^-2, and twice that where waves have no direction
    density = _SMOOTHEST * _REFERENCE**2 / 4 * np.where(within, waves, math.inf) ** -3
    noise = np.fft.rfft2(rng.standard_normal((_ALONG, _ACROSS)))
    return np.asarray(np.fft.irfft2(noise * np.sqrt(density) / _STEP, (_ALONG, _ACROSS)))
