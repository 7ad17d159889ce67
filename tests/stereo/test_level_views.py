"""When views are level enough, how they are levelled and resized: against the formulas of the method."""

import math

import numpy as np
import pytest

from rollcli.stereo import alignment
from rollcli.stereo.alignment import Approach, SmallViews, Tolerance, is_level, level, resampled, size_factor
from rollcli.stereo.misalignment import LEVEL, Misalignment

SHAPE = (200, 240)


def parts(offset=0.0, rotation=0.0, scale=0.0, corners=0.0, shape=SHAPE):
    return Misalignment(offset, rotation, scale, corners / (shape[0] * shape[1] / 4))


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("sure", [0.0, 2.0, 4.0])
def test_views_are_level_within_the_tolerance_and_some_standard_errors(place, sign, sure):
    limits, errors = (0.2, 0.003, 0.004, 0.5), (0.1, 0.001, 0.002, 0.05)
    tolerance = Tolerance(*limits, sure=sure)

    def one(value):
        return parts(*(sign * value if each == place else 0.0 for each in range(4)))

    assert is_level(one(0.99 * limits[place]), LEVEL, SHAPE, tolerance)
    assert not is_level(one(1.01 * limits[place]), LEVEL, SHAPE, tolerance)
    wider = limits[place] + sure * errors[place]
    assert is_level(one(0.99 * wider), parts(*errors), SHAPE, tolerance)
    assert not is_level(one(1.01 * wider), parts(*errors), SHAPE, tolerance)


@pytest.mark.parametrize(
    "lies",
    [
        Misalignment(12.0),
        Misalignment(-7.0),  # of half a pixel OpenCV 4 rounds every number up
        Misalignment(rotation=0.1),
        Misalignment(rotation=-0.05),
        Misalignment(scale=0.1),
        Misalignment(scale=-0.08),
        Misalignment(twist=0.001),
        Misalignment(3, 0.02, -0.05, -0.0005),
    ],
)
def test_each_pixel_comes_from_where_the_definition_says(lies):
    height, width = SHAPE
    v, u = np.mgrid[:height, :width]
    x, y = u - (width - 1) / 2, v - (height - 1) / 2
    from_v = v + lies.offset + lies.rotation * x + lies.scale * y + lies.twist * x * y
    from_u = u + lies.scale * x - lies.rotation * y

    rows, columns = level(v.astype(np.uint8), lies), level(u.astype(np.uint8), lies)

    # in the corners of an enlarged ramp the border repeats: its numbers are those of the nearest row
    np.testing.assert_allclose(rows, np.clip(from_v, 0, height - 1), atol=1)
    np.testing.assert_allclose(columns, np.clip(from_u, 0, width - 1), atol=1)
    inner = (np.abs(x) < 90) & (np.abs(y) < 70)
    assert abs((rows - from_v)[inner].mean()) < 0.05
    assert abs((columns - from_u)[inner].mean()) < 0.05


def test_a_level_view_is_not_touched():
    view = np.zeros(SHAPE, np.uint8)
    assert level(view, LEVEL) is view


@pytest.mark.parametrize("hidden", [-0.5, 0.0, 0.4, 0.66])
def test_two_measurements_tell_what_a_map_hides(hidden):
    rig, approach, at = parts(2, 0.01, -0.004, 0.8), Approach(SHAPE), LEVEL
    for _ in range(2):
        at = approach.next(at, rig - (rig - at).times(hidden))

    assert at.shifts(*SHAPE) == pytest.approx(rig.shifts(*SHAPE), abs=1e-4)


@pytest.mark.parametrize("left", [0.95, 0.6, 0.5, 1.25, 3, 1])
def test_the_next_start_is_not_further_than_twice_the_last_change(left):
    """Level measures 1 px; from 1 px `left` more are measured: the line through both, or twice the change."""
    approach = Approach(SHAPE)
    assert approach.next(LEVEL, Misalignment(1.0)) == Misalignment(1.0)

    second = approach.next(Misalignment(1.0), Misalignment(1.0 + left))

    line = left / (left - 1) if left != 1 else 0.0
    bounded = max(-2, min(2, line))
    assert second.offset == pytest.approx(1 + left - left * bounded, abs=1e-4)


@pytest.mark.parametrize(
    ("shape", "pixels", "factor"), [((300, 400), 30_000, 2), ((100, 300), 30_000, 1), ((10, 10), 30_000, 1)]
)
def test_a_view_is_shrunk_to_so_many_pixels_and_never_enlarged(shape, pixels, factor):
    assert size_factor(shape, pixels) == pytest.approx(factor)


def test_a_map_of_another_size_is_in_its_pixels():
    v, u = np.mgrid[:40, :60].astype(np.float32)
    slope = 10 + 0.5 * u + 0.25 * v
    assert resampled(slope, (40, 60)) is slope

    small = resampled(slope, (20, 30))
    assert small.shape == (20, 30)
    np.testing.assert_array_equal(small, slope[::2, ::2] / 2)

    large = resampled(slope, (80, 120))
    v, u = np.mgrid[:80, :120]
    expected = 2 * (10 + 0.5 * ((u + 0.5) / 2 - 0.5) + 0.25 * ((v + 0.5) / 2 - 0.5))
    np.testing.assert_allclose(large[2:-2, 2:-2], expected[2:-2, 2:-2], rtol=1e-5)


@pytest.mark.parametrize("factor", [2, 3])
def test_an_enlarged_map_has_no_number_that_a_hole_is_part_of(factor):
    values = np.full((20, 30), 5, np.float32)
    values[10, 12] = 0

    large = resampled(values, (20 * factor, 30 * factor))

    assert set(np.unique(large)) == {0, 5 * factor}
    v, u = np.nonzero(large == 0)
    near = (np.abs((v + 0.5) / factor - 10.5) < 1) & (np.abs((u + 0.5) / factor - 12.5) < 1)
    assert near.all()
    v, u = np.mgrid[: 20 * factor, : 30 * factor]
    touched = (np.abs((v + 0.5) / factor - 10.5) < 0.99) & (np.abs((u + 0.5) / factor - 12.5) < 0.99)
    assert not large[touched].any()


def test_small_views_measure_in_pixels_of_the_whole(monkeypatch):
    whole = (np.zeros((600, 800), np.uint8), np.ones((600, 800), np.uint8))
    small = SmallViews(whole)

    assert small.shape == (600, 800)
    assert small.factor == pytest.approx(2)
    assert [view.shape for view in small.views] == [(300, 400)] * 2
    assert [int(view.max()) for view in small.views] == [0, 1]
    assert [int(view.max()) for view in small.swapped().views] == [1, 0]
    assert small.closer.views[0] is whole[0]
    asked = []

    def measure(texture, disparity, start, rounds, every):
        asked.append((float(disparity.max()), disparity.shape, start, rounds, every))
        seen = Misalignment(1, 0.01, 0.02, 0.0004)
        return alignment.Measured(seen, seen, 0.5, 0.1)

    monkeypatch.setattr(alignment, "measure_misalignment", measure)
    found = small.measure(np.full((600, 800), 12, np.float32), Misalignment(3, 0.01, 0.02, 0.0001), 4)

    assert asked == [(6, (300, 400), Misalignment(1.5, 0.01, 0.02, 0.0002), 4, 1)]
    small.closer.measure(np.full((600, 800), 12, np.float32), LEVEL, 4)
    assert asked[1] == (12, (600, 800), LEVEL, 4, 4)  # as many pixels
    assert found.misalignment == found.errors == Misalignment(2, 0.01, 0.02, 0.0002)
    assert (found.share, found.spread) == (0.5, 0.2)
    monkeypatch.setattr(alignment, "measure_misalignment", lambda *_: None)
    assert small.measure(np.zeros((600, 800), np.float32), LEVEL) is None
    assert math.isclose(SmallViews((whole[0][:, :50], whole[1][:, :50])).factor, 1)
