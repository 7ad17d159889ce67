"""The truth is measured on the disparity itself, never on the renderer's own formulas."""

import math

import numpy as np
import pytest

from rollcli.simulate.render import true_disparity
from rollcli.simulate.spec import FrameSpec


def plane_roll(disparity: np.ndarray, used: np.ndarray) -> float:
    """theta of METHOD.md, degrees: atan(-c1 / c2) of the plane c0 + c1 u + c2 v through the used pixels."""
    v, u = np.nonzero(used)
    design = np.stack([np.ones(len(u)), u - u.mean(), v - v.mean()], axis=1)
    _, c1, c2 = np.linalg.lstsq(design, disparity[used], rcond=None)[0]
    return math.degrees(math.atan(-c1 / c2))


@pytest.mark.parametrize("roll_deg", [-80, -45, -7.3, 0, 1e-3, 12, 45, 80])
@pytest.mark.parametrize("pitch_deg", [-3, 0, 11])
@pytest.mark.parametrize("scene", ["bare", "street"])
def test_roll_is_the_angle_of_the_plane_through_a_flat_road_at_any_pitch(
    roll_deg: float, pitch_deg: float, scene: str
) -> None:
    spec = FrameSpec(
        scene, math.radians(roll_deg), math.radians(pitch_deg), size=(320, 240), focal=186, seed=4
    )
    disparity, road = true_disparity(spec)
    assert road.sum() > 2000
    assert plane_roll(disparity, road) == pytest.approx(roll_deg, abs=1e-6)


def test_a_rig_rolled_counter_clockwise_sees_its_right_side_farther_from_the_road() -> None:
    disparity, road = true_disparity(FrameSpec("bare", roll=math.radians(10), size=(320, 240), focal=186))
    row = disparity[-1]
    assert road[-1].any()
    assert np.all(np.diff(row) < 0)
