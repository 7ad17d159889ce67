"""How views lie, resized and said, and what a run says of it, against numbers worked out by hand."""

import itertools
import math
from dataclasses import replace

import pytest

from rollcli.files.results import Row
from rollcli.run.progress import RunSummary
from rollcli.stereo.correction import Correction
from rollcli.stereo.misalignment import Misalignment, advice_of


def test_views_twice_as_large_shift_twice_as_far_everywhere():
    lies = Misalignment(1.5, 0.02, -0.03, 0.004, 0.01, 0.002)

    assert lies.resized(2).shifts(200, 600) == pytest.approx([2 * each for each in lies.shifts(100, 300)])
    expected = (1.5, 0.02 * 150, -0.03 * 50, 0.004 * 150 * 50, 0.01 * 300 / 16, 0.002 * 50**2)
    assert lies.shifts(100, 300) == pytest.approx(expected)


def test_slopes_are_those_of_how_far_down_points_are_seen():
    lies, (x, y), step = Misalignment(1.5, 0.02, -0.03, 4e-5, 0.01, 2e-5), (150.0, -40.0), 1e-3
    across = lies.down(x + step, y) - lies.down(x - step, y)
    down = lies.down(x, y + step) - lies.down(x, y - step)
    assert lies.slopes(x, y) == pytest.approx((across / (2 * step), down / (2 * step)))


@pytest.mark.parametrize("sign", [-1, 1])
def test_what_a_result_says_is_in_px_degrees_and_per_cent_and_is_read_back(sign):
    odd = Misalignment(*(sign * each for each in (1.25, math.radians(0.125), 0.00375, 3e-5)))

    values = odd.values(200, 1000)
    found = Misalignment.of_values(values, 200, 1000)

    assert values == pytest.approx([sign * each for each in (1.25, 0.125, 0.375, 1.5)])
    assert found.parts == pytest.approx(odd.parts)


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


def row(lower=None, clockwise=0.0, **more):
    """A pair that was measured, unless `lower` is None."""
    if lower is None:
        return Row("l.png", "r.png", "ok", **more)
    lies = {"right_lower_px": lower, "right_clockwise_deg": clockwise}
    return Row("l.png", "r.png", "ok", **lies, right_larger_percent=0.0, right_twist_px=0.0)


def test_a_run_says_the_median_over_its_pairs_and_what_to_do():
    rig = RunSummary()
    for turned in (0.3, 0.31, 0.5):
        rig.add_row(row(0.0, turned))

    assert rig.alignment()["right_clockwise_deg"] == 0.31
    assert rig.alignment()["frames"] == 3
    assert rig.alignment()["advice"] == (
        "the right camera is rolled by 0.31 degrees against the left, counter-clockwise seen from behind: "
        "recalibrate, or give --align the file that `rig --correction` writes"
    )


@pytest.mark.parametrize(("turned", "advised"), [(0.3, ""), (0.36, "rolled by 0.06 degrees")])
def test_a_run_asks_for_what_is_left_beside_its_correction_at_any_size(turned, advised):
    told = Correction(Misalignment.of_values((2.0, 0.3, 0.0, 0.0), 480, 640), None, 0.0, 640, 480)
    rig = RunSummary()
    rig.add_row(replace(row(1.0, turned), width=320, height=240))

    advice = rig.alignment(told)["advice"]
    assert advised in advice
    assert bool(advice) == bool(advised)
    assert "lower" not in advice


def test_a_run_of_mostly_level_pairs_asks_for_nothing():
    rig = RunSummary()
    for lower in (0.01, -0.02, 1.0):
        rig.add_row(row(lower))

    assert rig.alignment()["advice"] == ""
    assert rig.alignment()["right_lower_px"] == 0.01


def test_a_run_of_maps_or_of_pairs_that_could_not_be_measured_has_nothing_to_say():
    rig = RunSummary()
    rig.add_row(Row("l.png", status="ok"))
    rig.add_row(row(message="the views are not level, and could not be levelled"))
    rig.add_row(Row("l.png", "r.png", "error", message="l.png: cannot be read"))

    assert rig.alignment() is None


@pytest.mark.parametrize("signs", list(itertools.product((-1, 1), repeat=4)))
def test_the_reach_is_the_largest_shift_of_the_four_corners(signs):
    parts = zip(signs, (0.7, 2e-3, 5e-3, 4e-5), strict=True)
    offset, rotation, scale, twist = (sign * size for sign, size in parts)
    corners = itertools.product((-320, 320), (-100, 100))  # of a view of 640 x 200 pixels
    shifts = [offset + rotation * x + scale * y + twist * x * y for x, y in corners]
    reach = Misalignment(offset, rotation, scale, twist).reach(200, 640)
    assert reach == pytest.approx(max(map(abs, shifts)))
