"""How views lie, added, resized and said, against numbers worked out by hand."""

import math

import pytest

from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.misalignment_words import advice_of


def test_parts_are_added_taken_away_and_multiplied():
    one, other = Misalignment(1, 0.2, 0.03, 0.004), Misalignment(0.5, -0.1, 0.01, 0.001)
    for found, expected in (
        (one + other, (1.5, 0.1, 0.04, 0.005)),
        (one - other, (0.5, 0.3, 0.02, 0.003)),
        (one.times(-2), (-2, -0.4, -0.06, -0.008)),
    ):
        assert (found.offset, found.rotation, found.scale, found.twist) == pytest.approx(expected)


def test_views_twice_as_large_shift_twice_as_far_everywhere():
    lies = Misalignment(1.5, 0.02, -0.03, 0.004, 0.01, 0.002)

    assert lies.resized(2).shifts(200, 600) == pytest.approx([2 * each for each in lies.shifts(100, 300)])
    expected = (1.5, 0.02 * 150, -0.03 * 50, 0.004 * 150 * 50, 0.01 * 300 / 16, 0.002 * 50**2)
    assert lies.shifts(100, 300) == pytest.approx(expected)


@pytest.mark.parametrize("sign", [-1, 1])
def test_what_a_result_says_is_in_px_degrees_and_per_cent_and_is_read_back(sign):
    odd = Misalignment(*(sign * each for each in (1.25, math.radians(0.125), 0.00375, 3e-5)))

    values = odd.values(200, 1000)
    found = Misalignment.of_values(values, 200, 1000)

    assert values == pytest.approx([sign * each for each in (1.25, 0.125, 0.375, 1.5)])
    assert found.parts == pytest.approx(odd.parts)


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        (Misalignment(rotation=math.radians(0.2)), "0.20 degrees against the left, counter-clockwise"),
        (Misalignment(rotation=math.radians(-0.2)), "0.20 degrees against the left, clockwise"),
        (Misalignment(offset=0.4), "lies 0.40 px lower"),
        (Misalignment(offset=-0.4), "lies 0.40 px higher"),
        (Misalignment(scale=0.004), "is 0.40 % larger"),
        (Misalignment(scale=-0.004), "is 0.40 % smaller"),
        (Misalignment(twist=-2e-5), "skewed by 1.0 px in the corners"),
    ],
)
def test_advice_names_the_way_of_each_part_alone(odd, words):
    advice = advice_of(*odd.values(200, 1000))

    assert words in advice
    assert advice.endswith(": recalibrate")
    assert advice.count("px") + advice.count("degrees") + advice.count("%") == 1


@pytest.mark.parametrize("sign", [-1, 1])
def test_no_advice_is_given_for_what_turns_a_road_by_less_than_a_tenth_of_a_degree(sign):
    for limit, part in (
        (0.03, lambda value: Misalignment(rotation=math.radians(value))),
        (0.15, lambda value: Misalignment(offset=value)),
        (0.1, lambda value: Misalignment(scale=value / 100)),
        (0.5, lambda value: Misalignment(twist=value / 50_000)),
    ):
        assert advice_of(*part(0.99 * sign * limit).values(200, 1000)) == ""
        assert advice_of(*part(1.01 * sign * limit).values(200, 1000))
