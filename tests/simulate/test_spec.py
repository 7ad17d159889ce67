"""Which rigs can be asked for, and that what is drawn depends on the seed and the frame's number alone."""

import math

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.simulate.options import SCENES, SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs


@pytest.mark.parametrize("pitch_deg", [0, 30])
def test_the_right_camera_is_above_the_road_just_when_the_baseline_leaves_room(pitch_deg):
    pitch = math.radians(pitch_deg)
    lowest = 0.54 * math.sin(math.radians(40)) * math.cos(pitch)
    FrameSpec(roll=-math.radians(40), pitch=pitch, height=lowest + 1e-6)
    FrameSpec(roll=math.radians(40), pitch=pitch, height=1e-6)
    with pytest.raises(UsageError, match="right camera is under the road"):
        FrameSpec(roll=-math.radians(40), pitch=pitch, height=lowest - 1e-6)


def test_without_ranges_the_documented_ones_are_drawn():
    specs = draw_specs(SimulateOptions(frames=3000, seed=8, cross_section="crown"))
    for values, low, high in (
        (np.degrees([spec.roll for spec in specs]), -10, 10),
        (np.degrees([spec.pitch for spec in specs]), -2, 6),
        ([100 * spec.crossfall for spec in specs], 1, 4),
        ([spec.curvature for spec in specs if spec.curvature], -0.001, 0.001),
    ):
        span = high - low
        assert low <= min(values) < low + 0.01 * span
        assert high - 0.01 * span < max(values) <= high
    rigs = {(s.height, s.baseline, s.focal, s.noise, s.size, s.kerb, s.gutter, s.centre) for s in specs}
    assert rigs == {(1.65, 0.54, 371.2, 1.5, (640, 480), (0.1, 0.2), 0.0, (319.5, 239.5))}


def test_mixed_draws_every_scene_and_only_a_bare_road_is_always_flat():
    specs = draw_specs(SimulateOptions(frames=400, seed=2))
    flat = {kind: np.mean([s.curvature == 0 for s in specs if s.scene == kind]) for kind in SCENES}
    assert flat.pop("bare") == 1
    assert all(0.3 < share < 0.7 for share in flat.values())
