"""What is concluded from small views, with measurements that are known."""

import math

import numpy as np
import pytest

from rollcli.stereo import first_look as module
from rollcli.stereo.alignment import Measured, SmallViews
from rollcli.stereo.first_look import FirstLook, _Small, first_look, look_for_range
from rollcli.stereo.misalignment import LEVEL, Misalignment
from tests.stereo.test_vertical_disparity import texture_of

SHAPE = (120, 160)
EMPTY = np.zeros(SHAPE, np.float32)


def measured(offset=0.0, scale=0.0, error=0.01, spread=0.1, rotation=0.0):
    return Measured(Misalignment(offset, rotation, scale), Misalignment(error), 0.5, spread)


def small(seen, top=20.0):
    return _Small(top, EMPTY, seen)


def pair_of(disparity, lower=0, shape=(240, 640)):
    texture = texture_of((shape[0] + 40, shape[1] + 400), seed=9)
    rows = slice(20, 20 + shape[0])
    left = texture[rows, 200 : 200 + shape[1]]
    right = texture[20 - lower : 20 - lower + shape[0], 200 + disparity : 200 + disparity + shape[1]]
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


@pytest.mark.parametrize("disparity", [8, 30, 60, 120, 200])
def test_the_range_holds_what_is_there_and_a_tenth_more(disparity):
    assert 1.1 * disparity + 5 <= look_for_range(pair_of(disparity)).range <= 1.1 * disparity + 12


def test_where_nothing_is_matched_no_range_is_found():
    flat = np.full((240, 640), 90, np.uint8)
    assert look_for_range((flat, flat)) == FirstLook(None, None)
    look = first_look(SmallViews((flat, flat)))
    assert look.range is None
    assert look.measured is None


@pytest.mark.parametrize("lower", [-6, -3, 0, 3, 6])
def test_a_look_finds_how_far_the_right_view_lies_off(lower):
    look = first_look(SmallViews(pair_of(40, lower)))

    assert look.measured.misalignment.offset == pytest.approx(lower, abs=0.12)
    assert look.measured.misalignment.rotation == pytest.approx(0, abs=0.0006)
    assert look.measured.misalignment.scale == pytest.approx(0, abs=0.002)
    assert (look.measured.misalignment == LEVEL) == (lower == 0)
    assert 49 <= look.range <= 56


@pytest.mark.parametrize(("error", "level"), [(0.07, True), (0.08, False)])
def test_small_views_with_large_errors_do_not_say_level(error, level):
    """Of views twice as large, the error is twice as large; 0.15 px are too many."""
    found = module._plainly_level(small(measured(0.01, error=error)), 2.0, (240, 320))

    assert (found is not None) == level
    if level:
        assert found.measured.misalignment == LEVEL
        assert found.measured.errors.offset == 2 * error
        assert found.range == math.ceil(1.1 * 40) + 8


def test_small_views_that_lie_off_or_tell_nothing_do_not_say_level():
    assert module._plainly_level(None, 2.0, SHAPE) is None
    assert module._plainly_level(small(None), 2.0, SHAPE) is None
    assert module._plainly_level(small(measured(0.2)), 1.0, SHAPE) is None
    assert module._plainly_level(small(measured(0.1, error=0.001)), 1.0, SHAPE) is not None
    assert module._plainly_level(small(measured(0.1, error=0.001)), 2.0, SHAPE) is None


@pytest.mark.parametrize(
    ("coarse", "fine", "sure"),
    [
        (measured(), measured(), True),
        (measured(), None, False),
        (measured(), measured(scale=0.0029, error=1.0), True),
        (measured(9), measured(scale=0.0029), True),
        (measured(scale=0.0031), measured(scale=0.0031), True),
        (measured(scale=-0.0031), measured(scale=-0.0031, error=0.015), False),
        (measured(scale=0.0031), measured(scale=0.0031, error=0.0135), True),
        (measured(1.1, scale=0.0031), measured(0.0, scale=0.0031), True),
        (measured(1.3, scale=0.0031), measured(0.0, scale=0.0031), False),
    ],
)
def test_an_unusual_scale_is_sure_where_blocks_and_views_agree(coarse, fine, sure):
    assert module._is_sure(coarse, fine, SHAPE) == sure


def test_the_clearest_attempt_leaves_the_least_unexplained():
    one, two, blind = small(measured(spread=0.3)), small(measured(spread=0.2)), small(None)
    assert module._clearest([one, None, two, blind]) is two
    assert module._clearest([blind, one]) is one
    assert module._clearest([None, blind]) is blind
    assert module._clearest([None]) is None


class Looks:
    """A rig of which each map hides a share, as `_look` would see it; it notes where and how it is asked."""

    def __init__(self, offset, hidden=0.0, blind_from=99, none_from=99):
        self.offset, self.hidden = offset, hidden
        self.blind_from, self.none_from, self.asked = blind_from, none_from, []

    def __call__(self, _pair, at):
        self.asked.append(at.offset)
        if len(self.asked) >= self.none_from:
            return None
        seen = self.offset - self.hidden * (self.offset - at.offset)
        return small(None if len(self.asked) >= self.blind_from else measured(seen), top=30 + len(self.asked))


PAIR = module._Pair.of((np.zeros(SHAPE, np.uint8),) * 2, 1)


def climb(monkeypatch, looks, **given):
    monkeypatch.setattr(module, "_look", looks)
    return module._climb(PAIR, LEVEL, **given)


def test_a_climb_ends_where_a_step_says_little(monkeypatch):
    looks = Looks(0.59)
    assert climb(monkeypatch, looks).measured.misalignment.offset == 0.59
    assert looks.asked == [0]
    looks = Looks(0.61)
    assert climb(monkeypatch, looks).measured.misalignment.offset == pytest.approx(0.61)
    assert looks.asked == [0, 0.61]


def test_a_climb_begins_with_what_is_known_and_gives_up_after_six_rounds(monkeypatch):
    looks = Looks(5.0)
    climb(monkeypatch, looks, first=small(measured(2.0)))
    assert looks.asked[0] == 2.0
    rig = Looks(0)

    def running(pair, at):
        rig.offset = at.offset + 4.0 * (-1) ** len(rig.asked)
        return rig(pair, at)

    assert climb(monkeypatch, running) is not None
    assert len(rig.asked) == 6


def test_a_climb_that_loses_the_scene_keeps_what_it_had(monkeypatch):
    assert climb(monkeypatch, Looks(3, none_from=1)) is None
    assert climb(monkeypatch, Looks(3, none_from=2)).measured.misalignment.offset == 3
    assert climb(monkeypatch, Looks(3, blind_from=2)).measured is None


def test_views_too_narrow_to_search_have_no_disparities():
    narrow = texture_of((40, 20))
    assert not module._match((narrow, narrow), 8).any()
    wide = pair_of(8, shape=(40, 120))
    assert np.median(module._match(wide, 8.2)[:, 40:100]) == pytest.approx(8, abs=0.1)


class Whole:
    """The views of a pair of 480 x 640 px at half of that; what is measured in them lies 0.7 px off."""

    shape, factor, views = (480, 640), 2.0, (np.zeros((240, 320), np.uint8),) * 2

    def __init__(self):
        self.asked = []

    def measure(self, disparity, start, rounds):
        self.asked.append((disparity, start, rounds))
        return measured(0.7)


BEFORE = 8.0  # the small views are so many times smaller than the whole ones


def test_without_a_small_match_larger_views_are_not_measured():
    whole = Whole()
    assert module._closer(whole, None, BEFORE) == (module.FirstLook(None, None), False)
    look, sure = module._closer(whole, small(None, top=8.0), BEFORE)
    assert (look.measured, sure) == (None, False)
    assert look.range == math.ceil(1.1 * 8 * BEFORE) + 8
    assert not whole.asked


def test_what_small_views_see_is_measured_at_larger_ones():
    whole, found = Whole(), small(measured(0.1, error=0.001), top=21.0)

    look, sure = module._closer(whole, found, BEFORE)

    assert whole.asked == [(found.disparity, Misalignment(0.1 * BEFORE), 4)]  # pixels of the whole views
    assert look == module.FirstLook(math.ceil(1.1 * 21 * BEFORE) + 8, measured(0.7), found.disparity)
    assert sure


class Attempts:
    """What `first_look` asks for: climbs by where they begin, and larger views by where these ended."""

    def __init__(self, monkeypatch, spreads, sure, seen=3.0):
        self.climbed, self.closer, self.sure = [], [], sure
        self.found = {key: small(measured(key, spread=value)) for key, value in spreads.items()}
        monkeypatch.setattr(module, "_look", lambda *_: small(measured(seen, error=0.001)))
        monkeypatch.setattr(module, "_climb", self.climb)
        monkeypatch.setattr(module, "_closer", self.look)

    def climb(self, _, start, first=None):
        self.climbed.append((start.offset, first is not None))
        return self.found[round(start.offset * 2 * math.sqrt(240 * 320 / 16_000), 6)]

    def look(self, _, found, before):
        assert before == pytest.approx(2 * math.sqrt(240 * 320 / 16_000))
        self.closer.append(found)
        return module.FirstLook(len(self.closer), found.measured), self.sure


def test_views_that_are_plainly_level_are_looked_at_once(monkeypatch):
    attempts = Attempts(monkeypatch, {}, sure=True, seen=0.001)
    assert first_look(Whole()).measured.misalignment == LEVEL
    assert not attempts.climbed


def test_a_sure_look_needs_no_other_start(monkeypatch):
    attempts = Attempts(monkeypatch, {0.0: 0.2}, sure=True)
    assert first_look(Whole()).measured is attempts.found[0.0].measured
    assert attempts.climbed == [(0, True)]


@pytest.mark.parametrize(
    ("spreads", "best", "looks"),
    [((0.2, 0.1, 0.3), -4.0, 2), ((0.2, 0.3, 0.1), 4.0, 2), ((0.1, 0.2, 0.3), 0.0, 1)],
)
def test_an_unsure_look_starts_4_px_higher_and_lower_too(monkeypatch, spreads, best, looks):
    attempts = Attempts(monkeypatch, dict(zip((0.0, -4.0, 4.0), spreads, strict=True)), sure=False)
    assert first_look(Whole()).measured is attempts.found[best].measured
    assert len(attempts.climbed) == 3
    assert len(attempts.closer) == looks
