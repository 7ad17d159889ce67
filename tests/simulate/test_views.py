"""The two views differ by parallax and noise alone, and hold no detail finer than their pixels."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from rollcli.simulate.build import build_scene, render_frame
from rollcli.simulate.spec import FrameSpec
from rollcli.simulate.views import render_view
from tests.slow import mostly_slow

CLEAN = {"noise": 0.0, "colour": False}
STREET = FrameSpec("street", math.radians(6), math.radians(2), seed=12, size=(320, 240), focal=186.0, **CLEAN)


def warped(image, disparity):
    """`image` of the right view, read where the left view's pixels are to be found."""
    v, u = np.indices(disparity.shape, np.float32)
    return cv2.remap(image.astype(np.float32), u - disparity, v, cv2.INTER_LINEAR, borderValue=np.nan)


@pytest.mark.parametrize("scene", ["open", "street", "verge"])
def test_the_right_view_moved_by_the_true_disparity_is_the_left_view(scene):
    spec = replace(STREET, scene=scene)
    frame = render_frame(spec)
    right_depth = render_view(build_scene(spec), spec.cameras()[1]).depth
    expected = spec.focal * spec.baseline / np.maximum(frame.disparity, 1e-6)
    seen_by_both = np.abs(warped(1 / right_depth, frame.disparity) * expected - 1) < 0.01
    seen_by_both &= np.indices(frame.disparity.shape)[1] - frame.disparity > 1
    assert seen_by_both.mean() > 0.4
    # the mean squared difference is a parabola of the shift: its lowest point is where the views agree
    shifts = (-0.5, 0.0, 0.5)
    before, there, after = (
        np.mean((warped(frame.right, frame.disparity + shift) - frame.left)[seen_by_both] ** 2)
        for shift in shifts
    )
    assert there < 0.5 * min(before, after)
    assert abs((before - after) / (before + after - 2 * there)) * 0.25 < 0.05


@pytest.mark.parametrize("scene", mostly_slow(["bare", "street"], "bare"))
def test_no_pixel_shows_detail_finer_than_itself(scene):
    spec = FrameSpec(scene, pitch=math.radians(2), size=(160, 120), focal=93, seed=5, **CLEAN)
    frame = render_frame(spec)
    fine = render_frame(replace(spec, size=(960, 720), focal=558)).left.astype(float)
    # what a pixel should show: the mean of 36 rays, each with a footprint of its own
    reference = fine.reshape(120, 6, 160, 6).mean(axis=(1, 3))
    far = frame.road & (np.arange(120) < 80)[:, None]  # there a pixel covers metres of road
    assert far.sum() > 300
    shown, sampled = (
        np.sqrt(np.mean((image - reference)[far] ** 2)) for image in (frame.left, fine[3::6, 3::6])
    )
    assert shown < 0.3 * reference[far].std()
    assert shown < 0.6 * sampled, "hardly better than one point of each pixel"
