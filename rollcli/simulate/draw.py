"""Draw the frames of a simulation from their ranges."""

import math
from dataclasses import replace
from typing import Any

from rollcli.errors import UsageError
from rollcli.simulate.options import (
    BASELINE,
    CROSS_SECTIONS,
    CROSSFALL,
    FOCAL_PER_WIDTH,
    HEIGHT,
    KERB,
    MIXED,
    NOISE,
    PITCH_DEG,
    ROLL_DEG,
    SCENES,
    SIZE,
)
from rollcli.simulate.spec import FrameSpec, Span, Stream, image_centre, not_one_of

_ROLL = (math.radians(ROLL_DEG[0]), math.radians(ROLL_DEG[1]))
_PITCH = (math.radians(PITCH_DEG[0]), math.radians(PITCH_DEG[1]))
_CROSSFALL = (CROSSFALL[0] / 100, CROSSFALL[1] / 100)
_NONE = (0.0, 0.0)


def draw_specs(
    n: int,
    *,
    scene: str = MIXED,
    roll: Span = _ROLL,
    pitch: Span = _PITCH,
    curvature: Span | None = None,
    bend: Span | None = None,
    cross_section: str = "flat",
    crossfall: Span = _CROSSFALL,
    gutter: Span = _NONE,
    kerb: Span = KERB,
    roughness: str | None = None,
    dips: int | None = None,
    size: tuple[int, int] = SIZE,
    focal: float | None = None,
    principal_point: Span | None = None,
    principal_offset: Span = _NONE,
    baseline: float = BASELINE,
    height: Span = (HEIGHT, HEIGHT),
    noise: float = NOISE,
    gain: float = 1.0,
    colour: bool = True,
    seed: int = 0,
) -> list[FrameSpec]:
    """Draw the specs of `n` frames; the i-th does not depend on `n`.

    Parameters
    ----------
    n : int
        Number of frames.
    scene : str
        One of `SCENES`, or ``mixed``: each frame draws one of them.
    roll, pitch : tuple of float
        Lowest and highest angle, radians; drawn evenly.
    curvature : tuple of float or None
        Lowest and highest vertical curvature, 1/m, drawn evenly. None: ``bare`` is flat, in the
        other scenes every second frame is flat and the others lie within +-0.001 (a radius of 1 km).
    bend : tuple of float or None
        Lowest and highest horizontal curvature, 1/m, drawn evenly. None: ``bare`` is straight, in the other
        scenes on average every second road is straight and the others lie within +-0.004 (a radius of 250 m).
    cross_section : str
        One of `CROSS_SECTIONS`, or ``mixed``: each frame draws one of them.
    crossfall, gutter : tuple of float
        Lowest and highest slope, metres per metre, drawn evenly; flat roads have no crossfall.
    focal : float or None
        PixelRays; None: 0.58 times the width.
    principal_point : tuple of float or None
        Column and row, pixels; None: the image's centre.
    principal_offset : tuple of float
        Lowest and highest offset of the principal point in each direction, pixels, drawn evenly.
    height : tuple of float
        Lowest and highest height of the left camera, metres, drawn evenly.

    Other parameters are those of `FrameSpec`.

    Raises
    ------
    UsageError
        A value is not possible, or values contradict each other.
    """
    if n < 1:
        raise UsageError(f"at least one frame must be asked for, not {n}")
    for kind, name, names in (("scene", scene, SCENES), ("cross section", cross_section, CROSS_SECTIONS)):
        if name not in (*names, MIXED):
            raise UsageError(not_one_of(kind, name, (*names, MIXED)))
    if seed < 0:
        raise UsageError(f"the seed must be 0 or more, not {seed}")
    rig = FrameSpec(
        size=size,
        focal=FOCAL_PER_WIDTH * size[0] if focal is None else focal,
        principal_point=principal_point,
        baseline=baseline,
        noise=noise,
        gain=gain,
        colour=colour,
        kerb=kerb,
        roughness=roughness,
        dips=dips,
        seed=seed,
    )
    spans = {
        "roll": roll,
        "pitch": pitch,
        "curvature": curvature or _NONE,
        "bend": bend or _NONE,
        "crossfall": crossfall,
        "gutter": gutter,
        "height": height,
    }
    _check_ends(rig, spans, principal_offset)
    frames = []
    for index in range(n):
        spec = _draw_pose(replace(rig, index=index), scene, roll, pitch, curvature)
        spec = _draw_cross_section(spec, cross_section, crossfall, gutter, bend)
        frames.append(_draw_rig(spec, height, principal_offset))
    return frames


def _check_ends(rig: FrameSpec, spans: dict[str, Span], principal_offset: Span) -> None:
    """Refuse ranges with an end that is not possible, whatever would be drawn."""
    for name, (low, high) in {**spans, "principal offset": principal_offset}.items():
        if not low <= high:
            raise UsageError(f"the range of the {name} is empty: its lower end comes first")
    lowest_height = spans.pop("height")[0]
    for end in (0, 1):
        values: dict[str, Any] = {name: span[end] for name, span in spans.items()}
        _offset(replace(rig, **values, height=lowest_height), principal_offset[end], principal_offset[end])


def _draw_pose(spec: FrameSpec, scene: str, roll: Span, pitch: Span, curvature: Span | None) -> FrameSpec:
    rng = spec.rng(Stream.POSE)
    theta, phi = rng.uniform(*roll), rng.uniform(*pitch)
    kind = SCENES[rng.integers(len(SCENES))] if scene == MIXED else scene
    drawn: float = rng.choice([0.0, 1.0]) * rng.uniform(-0.001, 0.001)
    if curvature is not None:
        drawn = rng.uniform(*curvature)
    elif kind == "bare":
        drawn = 0.0
    return replace(spec, scene=kind, roll=float(theta), pitch=float(phi), curvature=float(drawn))


def _draw_cross_section(
    spec: FrameSpec, kind: str, crossfall: Span, gutter: Span, bend: Span | None
) -> FrameSpec:
    rng = spec.rng(Stream.CROSS_SECTION)
    steepest, beside = rng.uniform(*crossfall), rng.uniform(*gutter)
    shape = CROSS_SECTIONS[rng.integers(len(CROSS_SECTIONS))] if kind == MIXED else kind
    fall = 0.0 if shape == "flat" else float(steepest)
    drawn = None if bend is None else float(rng.uniform(*bend))
    return replace(spec, cross_section=shape, crossfall=fall, gutter=float(beside), bend=drawn)


def _draw_rig(spec: FrameSpec, height: Span, principal_offset: Span) -> FrameSpec:
    rng = spec.rng(Stream.RIG)
    spec = replace(spec, height=float(rng.uniform(*height)))
    return _offset(spec, float(rng.uniform(*principal_offset)), float(rng.uniform(*principal_offset)))


def _offset(spec: FrameSpec, right: float, down: float) -> FrameSpec:
    """Return the frame with its principal point moved."""
    if not (right or down):
        return spec
    column, row = spec.principal_point or image_centre(spec.size)
    return replace(spec, principal_point=(column + right, row + down))
