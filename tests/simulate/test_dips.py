"""Dips and bumps against a march along each ray; true heights against points in space."""

import math

import numpy as np
import pytest

from rollcli.simulate.build import carriageway_of, draw_dips, render_frame
from rollcli.simulate.spec import FrameSpec
from tests.true_disparity import true_disparity

SMALL = {"size": (320, 120), "focal": 186.0, "pitch": 0.08}


def spec_of(**values):
    return FrameSpec(**{"scene": "bare", "dips": 4, "seed": 3, **SMALL, **values})


def test_true_heights_are_distances_from_the_plain_road():
    """Of a flat road under a rig: the distance of each pixel's point from the plane, by the pose alone."""
    spec = spec_of(roll=0.2)
    frame, (disparity, _) = render_frame(spec), true_disparity(spec)
    depth = spec.focal * spec.baseline / np.where(disparity > 0, disparity, np.nan)
    v, u = np.indices(disparity.shape)
    x, y = ((each - at) / spec.focal for each, at in ((u, spec.centre[0]), (v, spec.centre[1])))
    normal = (-math.sin(0.2) * math.cos(0.08), math.cos(0.2) * math.cos(0.08), math.sin(0.08))
    heights = spec.height - depth * (normal[0] * x + normal[1] * y + normal[2])
    assert np.allclose(frame.heights[frame.road], heights[frame.road], atol=1e-5)
    dips = draw_dips(spec, carriageway_of(spec))
    assert len(dips) == 4
    assert np.nanmin(frame.heights[frame.road]) == pytest.approx(min(dip.height for dip in dips), abs=1e-4)
    assert {np.sign(dip.height) for dip in dips} == {-1, 1}
    assert all(0.025 <= abs(dip.height) <= 0.07 for dip in dips)
