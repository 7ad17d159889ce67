"""Which rigs can be asked for, and that what is drawn depends on the seed and the frame's number alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.simulate.build import render_frame
from rollcli.simulate.options import SCENES, SimulateOptions
from rollcli.simulate.spec import FrameSpec, draw_specs

TINY = {"size": (64, 48), "focal": 37.0}


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"height": 0.0}, "under the road"),
        ({"height": -1.65}, "under the road"),
        ({"height": 0.3, "roll": math.radians(-60)}, "right camera is under the road"),
        ({"size": (0, 0)}, "0x0"),
        ({"kerb": (0.2, 0.1)}, "kerbs of 0.2 to 0.1 m"),
    ],
)
def test_a_rig_that_cannot_be_is_refused_and_the_reason_named(wrong, named):
    with pytest.raises(UsageError, match=named):
        FrameSpec(**wrong)


@pytest.mark.parametrize(
    ("name", "last", "beyond", "named"),
    [
        ("roll", math.pi / 2, 1.571, "roll of 90.01.* degrees is beyond"),
        ("roll", -math.pi / 2, -1.571, "roll of -90.01"),
        ("pitch", math.radians(60), 1.048, "pitch of 60.0"),
        ("pitch", -math.radians(60), -1.048, "pitch of -60.0"),
        ("curvature", 0.01, 0.0101, "curvature of 0.0101"),
        ("curvature", -0.01, -0.0101, "curvature of -0.0101"),
        ("bend", 0.02, 0.0201, "bend of 0.0201"),
        ("bend", -0.02, -0.0201, "bend of -0.0201"),
        ("crossfall", 0.15, 0.151, "crossfall of 15.1 %"),
        ("crossfall", 0.0, -0.001, "crossfall of -0.1 %"),
        ("gutter", 0.5, 0.501, "gutter of 50.1 %"),
        ("gutter", 0.0, -0.001, "gutter of -0.1 %"),
        ("kerb", (0.0, 0.5), (0.0, 0.501), "kerbs of 0 to 0.501 m"),
        ("kerb", (0.0, 0.0), (-0.001, 0.0), "kerbs of -0.001 to 0 m"),
        ("size", (16, 480), (15, 480), "15x480"),
        ("size", (640, 16), (640, 15), "640x15"),
        ("size", (16384, 16), (16385, 16), "16385x16"),
        ("size", (16, 16384), (16, 16385), "16x16385"),
        ("principal_point", (0.0, 479.0), (-0.1, 479.0), "principal point -0.1,479 lies outside"),
        ("principal_point", (639.0, 0.0), (639.1, 0.0), "principal point 639.1,0 lies outside"),
        ("principal_point", (0.0, 0.0), (0.0, -0.1), "principal point 0,-0.1 lies outside"),
        ("principal_point", (639.0, 479.0), (639.0, 479.1), "principal point 639,479.1 lies outside"),
    ],
)
def test_a_value_at_its_limit_is_taken_and_one_beyond_it_is_refused(name, last, beyond, named):
    others = {"principal_point": (1.0, 1.0)} if name == "size" else {"height": 3.0}
    assert getattr(FrameSpec(**{**others, name: last}), name) == last
    with pytest.raises(UsageError, match=named):
        FrameSpec(**{**others, name: beyond})


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


@pytest.mark.parametrize(
    "wrong",
    [
        {"roll_deg": (-91.0, 1.0)},
        {"pitch_deg": (0.0, 61.0)},
        {"height": (0.3, 0.3), "roll_deg": (-57.0, 57.0)},
        {"height": (0.0, 1.6)},
        {"principal_offset": (-400.0, 0.0)},
        {"principal_offset": (0.0, 400.0)},
        {"crossfall": (2.0, 20.0)},
    ],
)
def test_draws_that_cannot_be_are_refused_before_anything_is_drawn(wrong):
    with pytest.raises(UsageError):
        draw_specs(SimulateOptions(**{"frames": 3, **wrong}))


def test_a_frame_is_the_same_however_many_are_drawn():
    assert draw_specs(SimulateOptions(frames=3, seed=5)) == draw_specs(SimulateOptions(frames=30, seed=5))[:3]


def test_other_seeds_and_other_frames_are_other_scenes():
    first, second = draw_specs(SimulateOptions(frames=2, scene="street", seed=5, **TINY))
    third = draw_specs(SimulateOptions(frames=1, scene="street", seed=6, **TINY))[0]
    pictures = [render_frame(replace(each, roll=0.0, pitch=0.05)).left for each in (first, second, third)]
    assert not np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])


def test_mixed_draws_every_scene_and_only_a_bare_road_is_always_flat():
    specs = draw_specs(SimulateOptions(frames=400, seed=2))
    flat = {kind: np.mean([s.curvature == 0 for s in specs if s.scene == kind]) for kind in SCENES}
    assert flat.pop("bare") == 1
    assert all(0.3 < share < 0.7 for share in flat.values())


def test_offsets_are_from_the_principal_point_that_is_given():
    (spec,) = draw_specs(
        SimulateOptions(frames=1, principal_point=(300.0, 200.0), principal_offset=(5.0, 5.0))
    )
    assert spec.principal_point == (305.0, 205.0)


def test_a_curvature_that_is_asked_for_holds_for_every_scene():
    assert all(
        0.001 <= spec.curvature <= 0.002
        for spec in draw_specs(SimulateOptions(frames=40, curvature=(0.001, 0.002)))
    )
