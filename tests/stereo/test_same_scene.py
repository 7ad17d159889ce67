"""Which pairs are refused, by the shares of their blocks that tell."""

from types import SimpleNamespace

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.stereo import match as same_scene
from rollcli.stereo.alignment import Measured
from rollcli.stereo.first_look import FirstLook
from rollcli.stereo.misalignment import LEVEL

ONE, OTHER = np.zeros((8, 8), np.uint8), np.ones((8, 8), np.uint8)
SAME, SWAPPED, TWO = "image are the same", "the views seem swapped", "do not show the same scene"


def says(share):
    return None if share is None else Measured(LEVEL, LEVEL, share, 0.1, None)


def refusal(monkeypatch, *, textured=(1.0, 1.0), before=0.0, after=0.0, swapped=0.0, views=(ONE, OTHER)):
    shares = iter(textured)
    monkeypatch.setattr(same_scene, "textured_share", lambda _: next(shares))
    monkeypatch.setattr(same_scene, "first_look", lambda _: FirstLook(9, says(swapped)))
    small = SimpleNamespace(views=views, swapped=lambda: None)
    try:
        same_scene.check_same_scene(small, FirstLook(9, says(before)), says(after))
    except InputError as error:
        return next(each for each in (SAME, SWAPPED, TWO) if each in str(error))
    return None


@pytest.mark.parametrize("swapped", [None, 0.0, 0.9])
@pytest.mark.parametrize("views", [(ONE, OTHER), (ONE, ONE)])
def test_what_is_matched_is_one_scene(monkeypatch, swapped, views):
    """From 30 % of the blocks with texture on; the better of both measurements counts."""
    for given in ({"before": 0.3}, {"after": 0.3}, {"before": 0.3, "after": None}):
        assert refusal(monkeypatch, **given, swapped=swapped, views=views) is None
    assert refusal(monkeypatch, before=0.151, textured=(0.5, 0.9), swapped=swapped, views=views) is None
    assert refusal(monkeypatch, before=0.15, textured=(0.9, 0.5), swapped=swapped, views=views) is None


@pytest.mark.parametrize(
    ("textured", "before", "refused"),
    [
        ((1.0, 1.0), 0.199, TWO),
        ((1.0, 1.0), 0.2, None),
        ((1.0, 1.0), 0.25, None),
        ((0.9, 0.5), 0.099, TWO),
        ((0.5, 0.9), 0.101, None),
        ((0.07, 1.0), 0.0, TWO),
        ((0.069, 1.0), 0.0, None),
        ((1.0, 0.069), 0.0, None),
        ((1.0, 1.0), None, TWO),
    ],
)
def test_two_scenes_are_those_of_which_hardly_anything_is_matched(monkeypatch, textured, before, refused):
    assert refusal(monkeypatch, textured=textured, before=before, after=None) == refused
    assert refusal(monkeypatch, textured=textured, before=None, after=before) == refused


@pytest.mark.parametrize(
    ("textured", "swapped", "refused"),
    [(1.0, 0.4, SWAPPED), (1.0, 0.39, TWO), (0.5, 0.2, SWAPPED), (1.0, None, TWO)],
)
def test_swapped_views_are_those_that_are_matched_the_other_way_round(
    monkeypatch, textured, swapped, refused
):
    assert refusal(monkeypatch, textured=(textured, 1.0), swapped=swapped) == refused
    also = refusal(monkeypatch, textured=(textured, 1.0), swapped=swapped, before=0.25 * textured)
    assert also == (SWAPPED if refused == SWAPPED else None)


def test_one_image_is_told_from_two_that_are_swapped(monkeypatch):
    assert refusal(monkeypatch, views=(ONE, ONE.copy()), swapped=0.9) == SAME
    assert refusal(monkeypatch, views=(ONE, ONE.copy()), before=0.29) == SAME
