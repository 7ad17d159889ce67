"""What one simulated frame is, on which all of its bytes depend, and how frames are drawn from ranges."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from rollcli.errors import UsageError
from rollcli.simulate.options import (
    CROSS_SECTIONS,
    CROSSFALL,
    FOCAL_PER_WIDTH,
    KERB,
    MIXED,
    SCENES,
    SimulateOptions,
    Span,
)
from rollcli.simulate.vectors import Array
from rollcli.simulate.views import Camera, rig_axes

MAX_PITCH = math.radians(60)
MAX_CURVATURE = 0.01
MAX_BEND = 0.02
MAX_CROSSFALL, MAX_GUTTER = 0.15, 0.5
MAX_KERB = 0.5  # metres
LEVEL = np.array([0.0, 1.0, 0.0])  # the normal of a level road


class Stream(IntEnum):
    """The streams of random numbers of a frame: one for each part, so that no part changes another."""

    POSE = 0
    SCENE = 1
    SENSOR = 2
    CROSS_SECTION = 3
    RIG = 4
    ROUGHNESS = 5
    DIPS = 6


@dataclass(frozen=True)
class FrameSpec:
    """The parameters of one frame; equal specs give equal bytes.

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
    roughness : str or None
        The class of ISO 8608, one of `ROUGHNESS`; None: a smooth road.
    bend : float or None
        Horizontal curvature of the road, 1/m; positive bends to the right. None: drawn with the scene.
    dips : int or None
        How many dips and bumps the lane ahead has, as far as there is room; None: none, and no true heights.
    size : tuple of int
        Width and height, pixels.
    focal : float
        Focal length, pixels.
    principal_point : tuple of float or None
        Column and row, pixels from the centre of the top-left pixel; None: the image's centre.
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
    roughness: str | None = None
    bend: float | None = None
    dips: int | None = None
    size: tuple[int, int] = SimulateOptions.size
    focal: float = FOCAL_PER_WIDTH * SimulateOptions.size[0]
    principal_point: tuple[float, float] | None = None
    baseline: float = SimulateOptions.baseline
    height: float = SimulateOptions.height[0]
    noise: float = SimulateOptions.noise
    gain: float = 1.0
    colour: bool = True
    seed: int = 0
    index: int = 0

    def __post_init__(self) -> None:
        for problem in _problems(self):
            raise UsageError(problem)

    @property
    def centre(self) -> tuple[float, float]:
        """The principal point, pixels from the centre of the top-left pixel."""
        return self.principal_point or ((self.size[0] - 1) / 2, (self.size[1] - 1) / 2)

    def cameras(self, normal: Array = LEVEL) -> tuple[Camera, Camera]:
        """Return the left and the right camera of a rig on the plane through the origin with this normal."""
        axes = rig_axes(self.roll, self.pitch, normal)
        left = self.height * normal
        places = left, left + self.baseline * axes[0]
        first, second = (Camera(*self.size, self.focal, self.centre, axes, place) for place in places)
        return first, second

    def rng(self, stream: Stream) -> np.random.Generator:
        """Return the generator of one part of the frame."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.index, stream)))


def _problems(spec: FrameSpec) -> Iterator[str]:
    """Yield a message for each value that is not possible, of those that their option does not bound."""
    width, height = spec.size
    if not 0 <= spec.crossfall <= MAX_CROSSFALL:
        yield f"a crossfall of {100 * spec.crossfall:g} % is not within 0 and {100 * MAX_CROSSFALL:g} %"
    if not 0 <= spec.gutter <= MAX_GUTTER:
        yield f"a gutter of {100 * spec.gutter:g} % is not within 0 and {100 * MAX_GUTTER:g} %"
    if not 0 <= spec.kerb[0] <= spec.kerb[1] <= MAX_KERB:
        low, high = spec.kerb
        yield f"kerbs of {low:g} to {high:g} m do not lie within 0 and {MAX_KERB:g} m, the lower one first"
    if not (16 <= width <= 16384 and 16 <= height <= 16384):
        yield f"a size of {width}x{height} is not one of 16 to 16384 pixels each way"
    if not (0 <= spec.centre[0] <= width - 1 and 0 <= spec.centre[1] <= height - 1):
        yield f"the principal point {spec.centre[0]:g},{spec.centre[1]:g} lies outside of the image"
    if abs(spec.roll) > math.pi / 2:
        yield f"a roll of {math.degrees(spec.roll):g} degrees is beyond +-90"
    if abs(spec.pitch) > MAX_PITCH:
        yield f"a pitch of {math.degrees(spec.pitch):g} degrees is beyond +-60"
    if abs(spec.curvature) > MAX_CURVATURE:
        yield f"a curvature of {spec.curvature:g} per metre is beyond +-{MAX_CURVATURE:g} (a radius of 100 m)"
    if abs(spec.bend or 0.0) > MAX_BEND:
        yield f"a bend of {spec.bend:g} per metre is beyond +-{MAX_BEND:g} (a radius of 50 m)"
    if spec.height <= 0:
        yield f"at a height of {spec.height:g} m the camera is under the road: the height must be more than 0"
    elif spec.height + spec.baseline * math.sin(spec.roll) * math.cos(spec.pitch) <= 0:
        yield (
            f"at a roll of {math.degrees(spec.roll):g} degrees the right camera is under the road: "
            f"mount the rig higher than {spec.height:g} m, or its cameras closer than {spec.baseline:g} m"
        )


def draw_specs(options: SimulateOptions) -> list[FrameSpec]:
    """Draw the specs of the frames that are asked for; the i-th does not depend on their number.

    Raises
    ------
    UsageError
        A value is not possible, or values contradict each other.
    """
    rig = FrameSpec(
        size=options.size,
        focal=FOCAL_PER_WIDTH * options.size[0] if options.focal is None else options.focal,
        principal_point=options.principal_point,
        baseline=options.baseline,
        noise=options.noise,
        gain=options.gain,
        colour=not options.grey,
        kerb=options.kerb or KERB,
        roughness=options.roughness,
        dips=options.dips,
        seed=options.seed,
    )
    for end in (0, 1):  # what is not possible is refused, whatever would be drawn
        offset = options.principal_offset[end]
        first = replace(
            rig,
            roll=math.radians(options.roll_deg[end]),
            pitch=math.radians(options.pitch_deg[end]),
            curvature=options.curvature[end] if options.curvature else 0.0,
            bend=options.bend[end] if options.bend else None,
            crossfall=(options.crossfall or CROSSFALL)[end] / 100,
            gutter=options.gutter[end] / 100,
            height=options.height[0],
        )
        _offset(first, offset, offset)
    return [_drawn(replace(rig, index=index), options) for index in range(options.frames)]


def _drawn(spec: FrameSpec, options: SimulateOptions) -> FrameSpec:
    """Return the frame with its pose, its road and the place of its camera, each from a stream of its own."""
    rng = spec.rng(Stream.POSE)
    roll, pitch = (math.radians(rng.uniform(*span)) for span in (options.roll_deg, options.pitch_deg))
    scene = SCENES[rng.integers(len(SCENES))] if options.scene == MIXED else options.scene
    curvature: float = rng.choice([0.0, 1.0]) * rng.uniform(-0.001, 0.001)
    if options.curvature is not None:
        curvature = rng.uniform(*options.curvature)
    elif scene == "bare":
        curvature = 0.0
    rng = spec.rng(Stream.CROSS_SECTION)
    spans = options.crossfall or CROSSFALL, options.gutter
    crossfall, gutter = (float(rng.uniform(*span)) / 100 for span in spans)
    shape = options.cross_section
    if shape == MIXED:
        shape = CROSS_SECTIONS[rng.integers(len(CROSS_SECTIONS))]
    bend = None if options.bend is None else float(rng.uniform(*options.bend))
    rng = spec.rng(Stream.RIG)
    spec = replace(
        spec,
        scene=scene,
        roll=roll,
        pitch=pitch,
        curvature=float(curvature),
        cross_section=shape,
        crossfall=0.0 if shape == "flat" else crossfall,
        gutter=gutter,
        bend=bend,
        height=float(rng.uniform(*options.height)),
    )
    right, down = (float(rng.uniform(*options.principal_offset)) for _ in range(2))
    return _offset(spec, right, down)


def _offset(spec: FrameSpec, right: float, down: float) -> FrameSpec:
    """Return the frame with its principal point moved."""
    if not (right or down):
        return spec
    column, row = spec.centre
    return replace(spec, principal_point=(column + right, row + down))
