"""Which pairs are refused, and how often others are matched, with matches and measurements that are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.stereo import match
from rollcli.stereo.alignment import Measured
from rollcli.stereo.first_look import FirstLook
from rollcli.stereo.misalignment import LEVEL, Misalignment

ONE, OTHER = np.zeros((8, 8), np.uint8), np.ones((8, 8), np.uint8)
SAME, SWAPPED, TWO = "image are the same", "the views seem swapped", "do not show the same scene"


def says(share):
    return None if share is None else Measured(LEVEL, LEVEL, share, 0.1, None)


def refusal(monkeypatch, *, textured=(1.0, 1.0), before=0.0, after=0.0, swapped=0.0, views=(ONE, OTHER)):
    shares = iter(textured)
    monkeypatch.setattr(match, "textured_share", lambda _: next(shares))
    monkeypatch.setattr(match, "first_look", lambda _: FirstLook(9, says(swapped)))
    small = SimpleNamespace(views=views)
    try:
        match.check_same_scene(small, FirstLook(9, says(before)), says(after))
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


SHAPE = (200, 300)


class Rig:
    """A rig that lies off by what a function says of where it is levelled to; its maps are numbered."""

    def __init__(self, offset):
        self.offset, self.matched, self.shape, self.closer = offset, [], SHAPE, self

    def match(self, at):
        self.matched.append(round(at.offset, 3))
        return np.full(SHAPE, len(self.matched), np.float32)

    def measure(self, disparity, at, rounds, every=1):
        return lies(self.offset(at.offset))

    def run(self, monkeypatch, look):
        monkeypatch.setattr(match, "check_same_scene", lambda *_: None)
        found = match._match_levelled(self.match, self, FirstLook(20, look), False)
        assert found.disparity[0, 0] == len(self.matched)  # the map of the last match
        return round(found.corrected.offset, 3), found.doubt


def lies(offset):
    return Measured(Misalignment(offset), Misalignment(0.001, 1e-6, 1e-6, 1e-9), 0.5, 0.1, None)


def test_a_pair_that_runs_away_is_given_up_after_four_matches(monkeypatch):
    rig = Rig(lambda at: at + 1.0)
    corrected, doubt = rig.run(monkeypatch, lies(0.0))
    assert doubt == match.NOT_LEVELLED
    assert "of two moments" in doubt  # as where one camera is a frame late
    assert len(rig.matched) == 4
    assert corrected == rig.matched[-1]  # what was matched, not what would be tried next


def test_a_pair_that_a_look_led_astray_is_matched_as_it_is_too(monkeypatch):
    rig = Rig(lambda at: at + 1.0 if at else 0.0)
    assert rig.run(monkeypatch, lies(3.0)) == (0, "")
    assert rig.matched == [3, 4, 0]
