"""The road's pixels: between its edges, as long as there are any."""

import math

import numpy as np
import pytest

from rollcli.estimator.road import surface
from rollcli.estimator.road.edges import NO_EDGES, Edges
from rollcli.estimator.road.find import find_road
from rollcli.estimator.road.subsample import take_sample
from rollcli.simulate.render import true_disparity
from rollcli.simulate.spec import FrameSpec


@pytest.fixture(scope="module")
def found():
    disparity, _ = true_disparity(FrameSpec(scene="bare", roll=math.radians(-3), seed=2))
    sample = take_sample(disparity)
    return sample, find_road(sample, math.radians(45), 0)


def fitted(found, monkeypatch, edges):
    monkeypatch.setattr(surface, "find_edges", lambda *_: edges)
    return surface.fit_surface(*found, parabolic=True)


def test_pixels_beyond_an_edge_are_no_road(found, monkeypatch):
    whole = fitted(found, monkeypatch, NO_EDGES)
    half = fitted(found, monkeypatch, Edges(math.inf, 0.5))

    assert half.share < 0.9 * whole.share
    assert math.degrees(half.model.theta) == pytest.approx(-3, abs=0.05)


def test_edges_with_hardly_a_pixel_between_them_are_none(found, monkeypatch):
    whole = fitted(found, monkeypatch, NO_EDGES)
    none = fitted(found, monkeypatch, Edges(0.0, 0.001))

    assert none.edges == NO_EDGES
    np.testing.assert_array_equal(none.weights, whole.weights)
