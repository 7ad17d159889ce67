"""The range of a pair, found with matchers whose maps are known."""

import numpy as np
import pytest

from rollcli.stereo import first_look
from rollcli.stereo.first_look import largest_disparity, rough_largest


class Matcher:
    """A scene that is matched as well as can be: what lies beyond the search is another, wrong number."""

    def __init__(self, truth, wrong=0.5):
        self.truth, self.wrong, self.searched = truth, wrong, []

    def __call__(self, count):
        self.searched.append(count)
        return np.where(self.truth < count, self.truth, self.wrong * count)


def test_a_rough_look_searches_half_the_width_and_leaves_two_per_cent_aside():
    truth = np.arange(1.0, 101.0).reshape(10, 10)
    truth[0, :5] = 0  # no data
    match = Matcher(truth)

    assert rough_largest(match, 400) == pytest.approx(np.percentile(np.arange(6, 101), 98))
    assert match.searched == [200]


@pytest.mark.parametrize(("known", "found"), [(0, None), (1, None), (10, None), (11, 7.0)])
def test_a_hundredth_of_the_pixels_says_nothing(known, found):
    disparity = np.zeros(1000)
    disparity[:known] = 7

    assert rough_largest(lambda _: disparity.reshape(20, 50), 100) == found


def test_a_range_that_is_long_enough_is_searched_once_and_once_twice_as_wide():
    truth = np.linspace(1, 50, 5000).reshape(50, 100)
    match = Matcher(truth)

    found = largest_disparity(match, 1000, 50.0)

    assert match.searched == pytest.approx([74, 148])
    assert found.top == pytest.approx(np.percentile(truth, 99))
    np.testing.assert_array_equal(found.disparity, truth)


def test_without_a_start_a_rough_look_gives_it():
    truth = np.linspace(1, 50, 5000).reshape(50, 100)
    match = Matcher(truth)

    found = largest_disparity(match, 1000)

    rough = np.percentile(truth, 98)
    assert match.searched == pytest.approx([500, 1.4 * rough + 4, 2.8 * rough + 8])
    assert found.top == pytest.approx(np.percentile(truth, 99))


def test_no_search_is_wider_than_half_the_width():
    match = Matcher(np.linspace(1, 40, 5000).reshape(50, 100))

    largest_disparity(match, 120, 40.0)

    assert match.searched == pytest.approx([60, 60])


def test_a_range_that_is_too_short_grows_four_times_at_most():
    truth = np.linspace(1, 400, 40000).reshape(200, 200)
    match = Matcher(truth)

    found = largest_disparity(match, 4000, 10.0)

    narrow, wide = match.searched[::2], match.searched[1::2]
    assert len(narrow) == len(wide) == 4
    assert wide == pytest.approx([2 * each for each in narrow])
    assert (np.diff(narrow) > 8).all()
    assert found.top == pytest.approx(0.99 * narrow[-1], rel=0.02)
    match = Matcher(np.minimum(truth, 20))
    assert largest_disparity(match, 4000, 10.0).top == pytest.approx(20)
    assert len(match.searched) == 4  # once too short: 20 px are more than 18


def test_only_what_a_wider_search_finds_too_is_believed():
    narrow = np.full((10, 100), 20.0)
    wide = narrow.copy()
    wide[2:5], wide[5, :] = 20.99, 21.0
    wide[6:8] = 19.0
    wide[8:] = 0  # left of what a wider search can see
    maps = {32.0: narrow, 64.0: wide}

    found = largest_disparity(lambda count: maps[round(count, 6)], 1000, 20.0)

    assert found.top == 20
    assert (found.disparity[:5] == 20).all()
    assert not found.disparity[5:8].any()
    assert (found.disparity[8:] == 20).all()


def test_candidates_that_change_with_the_search_are_no_range():
    noise = np.random.default_rng(0)

    assert largest_disparity(lambda count: noise.uniform(1, count, (40, 40)) * 50, 4000, 10.0) is None
    assert largest_disparity(lambda _: np.zeros((40, 40)), 400) is None
    assert largest_disparity(lambda _: np.zeros((40, 40)), 400, 10.0) is None


VIEWS = (np.zeros((120, 160), np.uint8),) * 2


@pytest.mark.parametrize(
    ("rough", "start"), [(None, None), (19.9, 39.8), (20.0, None), (35.0, None)]
)  # views at half the size are 80 px wide: a quarter of them are 20
def test_half_the_size_gives_the_range_of_what_is_not_near(monkeypatch, rough, start):
    asked = []
    monkeypatch.setattr(first_look, "rough_largest", lambda _match, width: asked.append(width) or rough)
    monkeypatch.setattr(
        first_look, "largest_disparity", lambda _, width, start=None: asked.append((width, start))
    )
    assert first_look._match_small(VIEWS) is None
    near = [(160, None)]
    assert asked == [80, *([(160, start)] if start else []), *near]
