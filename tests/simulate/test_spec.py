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
        ({"roll": math.radians(90.5)}, "roll of 90.5 degrees is beyond"),
        ({"pitch": math.radians(-61)}, "pitch of -61 degrees"),
        ({"height": 0.0}, "under the road"),
        ({"height": -1.65}, "under the road"),
        ({"height": 0.3, "roll": math.radians(-60)}, "right camera is under the road"),
        ({"size": (8, 480)}, "8x480"),
        ({"size": (0, 0)}, "0x0"),
        ({"focal": 0.0}, "focal length"),
        ({"baseline": -0.1}, "baseline"),
        ({"noise": -1.0}, "noise"),
        ({"gain": 0.0}, "gain"),
        ({"curvature": 0.02}, "curvature of 0.02"),
        ({"scene": "beach"}, "no such scene: beach"),
        ({"focal": math.nan}, "finite"),
        ({"crossfall": 0.2}, "crossfall of 20 %"),
        ({"gutter": -0.1}, "gutter of -10 %"),
        ({"kerb": (0.2, 0.1)}, "kerbs of 0.2 to 0.1 m"),
        ({"principal_point": (640.0, 100.0)}, "principal point 640,100 lies outside"),
        ({"principal_point": (100.0, -1.0)}, "principal point 100,-1 lies outside"),
        ({"cross_section": "ridge"}, "no such cross section: ridge"),
    ],
)
def test_a_rig_that_cannot_be_is_refused_and_the_reason_named(wrong, named):
    with pytest.raises(UsageError, match=named):
        FrameSpec(**wrong)


@pytest.mark.parametrize(
    ("name", "last", "beyond"),
    [
        ("roll", math.pi / 2, 1.571),
        ("roll", -math.pi / 2, -1.571),
        ("pitch", math.radians(60), 1.048),
        ("pitch", -math.radians(60), -1.048),
        ("curvature", 0.01, 0.0101),
        ("bend", 0.02, 0.0201),
        ("bend", -0.02, -0.0201),
        ("curvature", -0.01, -0.0101),
        ("crossfall", 0.15, 0.151),
        ("crossfall", 0.0, -0.001),
        ("gutter", 0.5, 0.501),
        ("gutter", 0.0, -0.001),
        ("kerb", (0.0, 0.5), (0.0, 0.501)),
        ("kerb", (0.0, 0.0), (-0.001, 0.0)),
        ("size", (16, 480), (15, 480)),
        ("size", (640, 16), (640, 15)),
        ("size", (16384, 16), (16385, 16)),
        ("size", (16, 16384), (16, 16385)),
        ("principal_point", (0.0, 479.0), (-0.1, 479.0)),
        ("principal_point", (639.0, 0.0), (639.1, 0.0)),
        ("principal_point", (0.0, 0.0), (0.0, -0.1)),
        ("principal_point", (639.0, 479.0), (639.0, 479.1)),
        ("noise", 0.0, -0.001),
    ],
)
def test_a_value_at_its_limit_is_taken_and_one_beyond_it_is_refused(name, last, beyond):
    others = {"principal_point": (1.0, 1.0)} if name == "size" else {"height": 3.0}
    assert getattr(FrameSpec(**{**others, name: last}), name) == last
    with pytest.raises(UsageError):
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
        {"frames": 0},
        {"scene": "beach"},
        {"seed": -1},
        {"roll_deg": (2.0, 1.0)},
        {"roll_deg": (-91.0, 1.0)},
        {"pitch_deg": (0.0, 61.0)},
        {"height": (0.3, 0.3), "roll_deg": (-57.0, 57.0)},
        {"height": (0.0, 1.6)},
        {"height": (1.7, 1.6)},
        {"principal_offset": (-400.0, 0.0)},
        {"principal_offset": (0.0, 400.0)},
        {"crossfall": (2.0, 20.0)},
        {"gutter": (10.0, 0.0)},
        {"cross_section": "ridge"},
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


def test_a_spec_gives_the_same_frame_each_time():
    spec = draw_specs(SimulateOptions(frames=1, scene="open", seed=3, **TINY))[0]
    once, twice = render_frame(spec), render_frame(spec)
    assert once.left.tobytes() == twice.left.tobytes()
    assert once.right.tobytes() == twice.right.tobytes()
    assert once.disparity.tobytes() == twice.disparity.tobytes()


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


def test_the_focal_length_follows_the_width():
    assert draw_specs(SimulateOptions(frames=1, size=(1000, 300)))[0].focal == pytest.approx(580)
