"""What one simulated frame is: the rig, the scene and the seeds, all that its bytes depend on."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rollcli.errors import UsageError
from rollcli.simulate.camera import Camera, rig_axes
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
from rollcli.simulate.vectors import Array

Span = tuple[float, float]

_ROLL = (math.radians(ROLL_DEG[0]), math.radians(ROLL_DEG[1]))
_CROSSFALL = (CROSSFALL[0] / 100, CROSSFALL[1] / 100)
_PITCH = (math.radians(PITCH_DEG[0]), math.radians(PITCH_DEG[1]))
MAX_PITCH = math.radians(60)
MAX_CURVATURE = 0.01
MAX_CROSSFALL, MAX_GUTTER = 0.15, 0.5
MAX_KERB = 0.5  # metres
_LEVEL = np.array([0.0, 1.0, 0.0])

# streams of random numbers of a frame: each part draws from its own, so that one cannot shift another
_POSE, _SCENE, _SENSOR, _ROAD = range(4)


@dataclass(frozen=True)
class FrameSpec:
    """One frame to render; equal specs give equal bytes.

    Parameters
    ----------
    scene : str
        One of `SCENES`.
    roll, pitch : float
        Radians, against the plane that touches the road below the left camera. Positive roll: the rig's
        right end is up. Positive pitch: it looks down at the road.
    curvature : float
        Second derivative of the road's height along the driving direction, 1/m; a sag is positive, a
        crest negative.
    cross_section : str
        One of `CROSS_SECTIONS`.
    crossfall : float
        The steepest slope across the carriageway, metres per metre; 0 when it is flat.
    gutter : float
        How much more steeply the carriageway falls outward in its gutters, metres per metre.
    kerb : tuple of float
        The lowest and the highest kerb, metres above the edge of the carriageway.
    size : tuple of int
        Width and height, pixels.
    focal : float
        Focal length, pixels.
    baseline, height : float
        Metres; the height is that of the left camera over the plane that touches the road below it.
    noise : float
        Standard deviation of the sensor's noise, grey levels of 255.
    gain : float
        Brightness of the right view relative to the left one.
    colour : bool
        Three channels (BGR) or one.
    seed, index : int
        The random content is drawn from these two.
    """

    scene: str = "street"
    roll: float = 0.0
    pitch: float = 0.0
    curvature: float = 0.0
    cross_section: str = "flat"
    crossfall: float = 0.0
    gutter: float = 0.0
    kerb: Span = KERB
    size: tuple[int, int] = SIZE
    focal: float = FOCAL_PER_WIDTH * SIZE[0]
    baseline: float = BASELINE
    height: float = HEIGHT
    noise: float = NOISE
    gain: float = 1.0
    colour: bool = True
    seed: int = 0
    index: int = 0

    def __post_init__(self) -> None:
        for problem in _problems(self):
            raise UsageError(problem)

    def cameras(self, normal: Array = _LEVEL) -> tuple[Camera, Camera]:
        """The left and the right camera of a rig on a plane through the origin, whose `normal` points up."""
        axes = rig_axes(self.roll, self.pitch, normal)
        left = self.height * normal
        centre = (self.size[0] - 1) / 2, (self.size[1] - 1) / 2
        places = left, left + self.baseline * axes[0]
        first, second = (Camera(*self.size, self.focal, centre, axes, place) for place in places)
        return first, second

    def scene_rng(self) -> np.random.Generator:
        """Random numbers for what stands where and what it looks like."""
        return _stream(self.seed, self.index, _SCENE)

    def sensor_rng(self) -> np.random.Generator:
        """Random numbers for the noise of both views."""
        return _stream(self.seed, self.index, _SENSOR)


def draw_specs(
    n: int,
    *,
    scene: str = MIXED,
    roll: Span = _ROLL,
    pitch: Span = _PITCH,
    curvature: Span | None = None,
    cross_section: str = "flat",
    crossfall: Span = _CROSSFALL,
    gutter: Span = (0.0, 0.0),
    kerb: Span = KERB,
    size: tuple[int, int] = SIZE,
    focal: float | None = None,
    baseline: float = BASELINE,
    height: float = HEIGHT,
    noise: float = NOISE,
    gain: float = 1.0,
    colour: bool = True,
    seed: int = 0,
) -> list[FrameSpec]:
    """The specs of `n` frames; the i-th is the same whatever `n` is.

    Parameters
    ----------
    n : int
        How many.
    scene : str
        One of `SCENES`, or ``mixed``: each frame draws one of them.
    roll, pitch : tuple of float
        Lowest and highest angle, radians; drawn evenly.
    curvature : tuple of float or None
        Lowest and highest vertical curvature, 1/m, drawn evenly. None: ``bare`` is flat, in the
        other scenes every second frame is flat and the others lie within +-0.001 (a radius of 1 km).
    cross_section : str
        One of `CROSS_SECTIONS`, or ``mixed``: each frame draws one of them.
    crossfall, gutter : tuple of float
        Lowest and highest slope, metres per metre, drawn evenly; flat roads have no crossfall.
    focal : float or None
        Pixels; None: 0.58 times the width.

    Other parameters are those of `FrameSpec`.

    Raises
    ------
    UsageError
        A number that cannot be, or numbers that contradict each other.
    """
    if n < 1:
        raise UsageError(f"at least one frame must be asked for, not {n}")
    if scene not in (*SCENES, MIXED):
        raise UsageError(f"no such scene: {scene}; choose one of {', '.join((*SCENES, MIXED))}")
    if cross_section not in (*CROSS_SECTIONS, MIXED):
        raise UsageError(_no_such_section(cross_section, (*CROSS_SECTIONS, MIXED)))
    if seed < 0:
        raise UsageError(f"the seed must be 0 or more, not {seed}")
    spans = {"roll": roll, "pitch": pitch, "curvature": curvature or (0.0, 0.0)}
    for name, span in (spans | {"crossfall": crossfall, "gutter": gutter}).items():
        if not span[0] <= span[1]:
            raise UsageError(f"the range of the {name} is empty: its lower end comes first")
    rig = FrameSpec(
        size=size,
        focal=FOCAL_PER_WIDTH * size[0] if focal is None else focal,
        baseline=baseline,
        height=height,
        noise=noise,
        gain=gain,
        colour=colour,
        kerb=kerb,
        seed=seed,
    )
    for angles in zip(*spans.values(), strict=True):
        _posed(rig, *angles)  # what cannot be is refused whatever is drawn
    for slopes in zip(crossfall, gutter, strict=True):
        replace(rig, crossfall=slopes[0], gutter=slopes[1])
    frames = (_draw(rig, index, scene, roll, pitch, curvature) for index in range(n))
    return [_draw_section(spec, cross_section, crossfall, gutter) for spec in frames]


def _draw(
    rig: FrameSpec, index: int, scene: str, roll: Span, pitch: Span, curvature: Span | None
) -> FrameSpec:
    rng = _stream(rig.seed, index, _POSE)
    theta, phi = rng.uniform(*roll), rng.uniform(*pitch)
    kind = SCENES[rng.integers(len(SCENES))] if scene == MIXED else scene
    bend: float = rng.choice([0.0, 1.0]) * rng.uniform(-0.001, 0.001)
    if curvature is not None:
        bend = rng.uniform(*curvature)
    elif kind == "bare":
        bend = 0.0
    return replace(_posed(rig, float(theta), float(phi), float(bend)), scene=kind, index=index)


def _draw_section(spec: FrameSpec, kind: str, crossfall: Span, gutter: Span) -> FrameSpec:
    rng = _stream(spec.seed, spec.index, _ROAD)
    steepest, beside = rng.uniform(*crossfall), rng.uniform(*gutter)
    shape = CROSS_SECTIONS[rng.integers(len(CROSS_SECTIONS))] if kind == MIXED else kind
    fall = 0.0 if shape == "flat" else float(steepest)
    return replace(spec, cross_section=shape, crossfall=fall, gutter=float(beside))


def _posed(rig: FrameSpec, roll: float, pitch: float, curvature: float) -> FrameSpec:
    return replace(rig, roll=roll, pitch=pitch, curvature=curvature)


def _no_such_section(name: str, names: tuple[str, ...]) -> str:
    return f"no such cross section: {name}; choose one of {', '.join(names)}"


def _stream(seed: int, index: int, part: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index, part)))


def _problems(spec: FrameSpec) -> Iterator[str]:
    """What cannot be, in words; nothing when the spec is sound."""
    width, height = spec.size
    numbers = (
        spec.roll,
        spec.pitch,
        spec.curvature,
        spec.focal,
        spec.baseline,
        spec.height,
        spec.noise,
        spec.gain,
        spec.crossfall,
        spec.gutter,
        *spec.kerb,
    )
    if not all(map(math.isfinite, numbers)):
        yield "every number of a simulated rig must be finite"
    if spec.scene not in SCENES:
        yield f"no such scene: {spec.scene}; choose one of {', '.join(SCENES)}"
    if spec.cross_section not in CROSS_SECTIONS:
        yield _no_such_section(spec.cross_section, CROSS_SECTIONS)
    if not 0 <= spec.crossfall <= MAX_CROSSFALL:
        yield f"a crossfall of {100 * spec.crossfall:g} % is not within 0 and {100 * MAX_CROSSFALL:g} %"
    if not 0 <= spec.gutter <= MAX_GUTTER:
        yield f"a gutter of {100 * spec.gutter:g} % is not within 0 and {100 * MAX_GUTTER:g} %"
    if not 0 <= spec.kerb[0] <= spec.kerb[1] <= MAX_KERB:
        low, high = spec.kerb
        yield f"kerbs of {low:g} to {high:g} m do not lie within 0 and {MAX_KERB:g} m, the lower one first"
    if not (16 <= width <= 16384 and 16 <= height <= 16384):
        yield f"a size of {width}x{height} is not one of 16 to 16384 pixels each way"
    if spec.focal <= 0:
        yield f"the focal length must be more than 0 px, not {spec.focal:g}"
    if spec.baseline <= 0:
        yield f"the baseline must be more than 0 m, not {spec.baseline:g}"
    if abs(spec.roll) > math.pi / 2:
        yield f"a roll of {math.degrees(spec.roll):g} degrees is beyond +-90"
    if abs(spec.pitch) > MAX_PITCH:
        yield f"a pitch of {math.degrees(spec.pitch):g} degrees is beyond +-60"
    if abs(spec.curvature) > MAX_CURVATURE:
        yield f"a curvature of {spec.curvature:g} per metre is beyond +-{MAX_CURVATURE:g} (a radius of 100 m)"
    if spec.noise < 0:
        yield f"the noise must be 0 or more grey levels, not {spec.noise:g}"
    if spec.gain <= 0:
        yield f"the gain must be more than 0, not {spec.gain:g}"
    if spec.height <= 0:
        yield f"at a height of {spec.height:g} m the camera is under the road: the height must be more than 0"
    elif spec.height + spec.baseline * math.sin(spec.roll) * math.cos(spec.pitch) <= 0:
        yield (
            f"at a roll of {math.degrees(spec.roll):g} degrees the right camera is under the road: "
            f"mount the rig higher than {spec.height:g} m, or its cameras closer than {spec.baseline:g} m"
        )
