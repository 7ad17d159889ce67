"""The truth is measured on the disparity itself, never on the renderer's own formulas."""

import math

import numpy as np
import pytest

from rollcli.simulate.build import carriageway_of, draw_dips, render_frame
from rollcli.simulate.spec import FrameSpec
from tests.true_disparity import true_disparity

SMALL = {"size": (320, 240), "focal": 186.0}


def plane_roll(disparity, used):
    """The roll, degrees: atan(-c1 / c2) of the plane c0 + c1 u + c2 v through the used pixels."""
    v, u = np.nonzero(used)
    design = np.stack([np.ones(len(u)), u - u.mean(), v - v.mean()], axis=1)
    _, c1, c2 = np.linalg.lstsq(design, disparity[used], rcond=None)[0]
    return math.degrees(math.atan(-c1 / c2))


@pytest.mark.parametrize("roll_deg", [-80, -45, -7.3, 0, 1e-3, 12, 45, 80])
@pytest.mark.parametrize("pitch_deg", [-3, 0, 11])
@pytest.mark.parametrize("scene", ["bare", "street"])
def test_roll_is_the_angle_of_the_plane_through_a_flat_road_at_any_pitch(roll_deg, pitch_deg, scene):
    spec = FrameSpec(scene, math.radians(roll_deg), math.radians(pitch_deg), seed=4, **SMALL)
    disparity, road = true_disparity(spec)
    assert road.sum() > 2000
    assert plane_roll(disparity, road) == pytest.approx(roll_deg, abs=1e-6)


def rotation(roll, pitch):
    """World from camera (X right, Y up, Z ahead; x right, y down, z ahead): roll, then pitch, as matrices."""
    flip = np.diag([1.0, -1.0, 1.0])
    turn = np.array([[np.cos(roll), np.sin(roll), 0], [-np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.cos(pitch), np.sin(pitch)], [0, -np.sin(pitch), np.cos(pitch)]])
    return flip @ tilt @ turn


@pytest.mark.parametrize("curvature", [0.0, 0.002, -0.002])
@pytest.mark.parametrize(("roll_deg", "pitch_deg"), [(0, 0), (25, 4), (-60, -2)])
@pytest.mark.parametrize("centre", [(159.5, 119.5), (130.25, 141.0)])
def test_points_from_the_disparity_lie_on_the_road(curvature, roll_deg, pitch_deg, centre):
    roll, pitch = map(math.radians, (roll_deg, pitch_deg))
    spec = FrameSpec("verge", roll, pitch, curvature, principal_point=centre, seed=2, **SMALL)
    (cx, cy), (disparity, road) = centre, true_disparity(spec)
    v, u = np.nonzero(road)
    depth = spec.focal * spec.baseline / disparity[road]
    rays = np.stack([(u - cx) / spec.focal, (v - cy) / spec.focal, np.ones(len(u))])
    turned = rotation(roll, pitch)
    x, y, z = turned @ (depth * rays) + np.array([[0.0], [spec.height], [0.0]])
    assert np.abs(y - curvature / 2 * z**2).max() < 1e-9
    # the right camera is a baseline along the rig's own x axis, and sees the point that much to the left
    right = np.array([0.0, spec.height, 0.0]) + turned @ [spec.baseline, 0.0, 0.0]
    seen = turned.T @ (np.stack([x, y, z]) - right[:, None])
    assert np.allclose(spec.focal * seen[0] / seen[2] + cx, u - disparity[road], atol=1e-9)
    assert np.allclose(spec.focal * seen[1] / seen[2] + cy, v, atol=1e-9)


def test_true_heights_are_distances_from_the_plain_road():
    """Of a flat road under a rig: the distance of each pixel's point from the plane, by the pose alone."""
    spec = FrameSpec("bare", 0.2, 0.08, dips=4, seed=3, size=(320, 120), focal=186.0)
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
