"""What one simulated frame is, on which all of its bytes depend, and how frames are drawn from ranges."""

import math
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np

from rollcli.errors import UsageError
from rollcli.simulate.options import CROSSFALL, FOCAL_PER_WIDTH, KERB, Rendering, SimulateOptions, Span
from rollcli.simulate.relief import Array
from rollcli.simulate.views import Camera, rig_axes

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
class FrameSpec(Rendering):
    """The parameters of one frame, beside those that all have; equal specs give equal bytes.

    Parameters
    ----------
    scene : str
        One of `options.SCENES`.
    roll, pitch : float
        Radians, against the plane that touches the road below the left camera. Positive roll: the rig's
        right end is up. Positive pitch: it looks down at the road.
    curvature : float
        Second derivative of the road's height along the driving direction, 1/m; a sag is positive, a
        crest negative.
    cross_section : str
        One of `options.CROSS_SECTIONS`.
    crossfall : float
        The steepest slope across the carriageway, metres per metre; 0 when it is flat.
    gutter : float
        How much more steeply the carriageway falls outward in its gutters, metres per metre.
    kerb : tuple of float
        The lowest and the highest kerb, metres above the edge of the carriageway.
    bend : float or None
        Horizontal curvature of the road, 1/m; positive bends to the right. None: drawn with the scene.
    focal : float
        Focal length, pixels.
    height : float
        Of the left camera over the plane that touches the road below it, metres.
    colour : bool
        Three channels (BGR) or one.
    index : int
        The frame's number.
    """

    scene: str = "street"
    roll: float = 0.0
    pitch: float = 0.0
    curvature: float = 0.0
    cross_section: str = "flat"
    crossfall: float = 0.0
    gutter: float = 0.0
    kerb: Span = KERB
    bend: float | None = None
    focal: float = FOCAL_PER_WIDTH * Rendering.size[0]
    height: float = SimulateOptions.height[0]
    colour: bool = True
    index: int = 0

    def __post_init__(self) -> None:
        (column, row), (width, height) = self.centre, self.size
        if not (0 <= column <= width - 1 and 0 <= row <= height - 1):
            raise UsageError(f"the principal point {column:g},{row:g} lies outside of the image")
        if self.height + self.baseline * math.sin(self.roll) * math.cos(self.pitch) <= 0:
            raise UsageError(
                f"at a roll of {math.degrees(self.roll):g} degrees the right camera is under the road: "
                f"mount the rig higher than {self.height:g} m, or its cameras closer than {self.baseline:g} m"
            )

    @property
    def centre(self) -> tuple[float, float]:
        """The principal point, pixels from the centre of the top-left pixel."""
        return self.principal_point or ((self.size[0] - 1) / 2, (self.size[1] - 1) / 2)

    def cameras(self, normal: Array = LEVEL) -> list[Camera]:
        """Return the left and the right camera of a rig on the plane through the origin with this normal."""
        axes = rig_axes(self.roll, self.pitch, normal)
        left = self.height * normal
        places = left, left + self.baseline * axes[0]
        return [Camera(*self.size, self.focal, self.centre, axes, place) for place in places]

    @property
    def nearest_disparity(self) -> float:
        """The largest disparity of a flat road, pixels; linear in the image, it is largest in a corner."""
        (width, height), (camera, _) = self.size, self.cameras()
        corners = camera.rays(np.array([0, width - 1] * 2), np.array([0, 0, height - 1, height - 1]))
        return float((-self.focal * self.baseline / self.height * corners.direction[1]).max())

    def rng(self, stream: Stream) -> np.random.Generator:
        """Return the generator of one part of the frame."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.index, stream)))


def draw_specs(options: SimulateOptions) -> list[FrameSpec]:
    """Draw the specs of the frames that are asked for; the i-th does not depend on their number.

    Raises
    ------
    UsageError
        Values contradict each other.
    """
    rig = FrameSpec(
        **{each.name: getattr(options, each.name) for each in fields(Rendering)},
        focal=FOCAL_PER_WIDTH * options.size[0] if options.focal is None else options.focal,
        colour=not options.grey,
        kerb=options.kerb or KERB,
    )
    # what is not possible is refused, whatever would be drawn: a level rig has its right camera lowest
    pitch = math.radians(np.clip(0.0, *options.pitch_deg))
    for roll, offset in zip(options.roll_deg, options.principal_offset, strict=True):
        lowest = replace(rig, roll=math.radians(roll), pitch=pitch, height=options.height[0])
        _offset(lowest, offset, offset)
    return [_drawn(replace(rig, index=index), options) for index in range(options.frames)]


def _drawn(spec: FrameSpec, options: SimulateOptions) -> FrameSpec:
    """Return the frame with the place of its camera, its pose and its road, each from a stream of its own."""
    rng = spec.rng(Stream.RIG)
    spec = replace(spec, height=float(rng.uniform(*options.height)))
    spec = _offset(spec, *(float(rng.uniform(*options.principal_offset)) for _ in range(2)))
    rng = spec.rng(Stream.POSE)
    roll, pitch = (math.radians(rng.uniform(*span)) for span in (options.roll_deg, options.pitch_deg))
    scene = options.scenes[rng.integers(len(options.scenes))]
    curvature: float = rng.choice([0.0, 1.0]) * rng.uniform(-0.001, 0.001)
    if options.curvature is not None:
        curvature = rng.uniform(*options.curvature)
    elif scene == "bare":
        curvature = 0.0
    spec = replace(spec, scene=scene, roll=roll, pitch=pitch, curvature=float(curvature))
    rng = spec.rng(Stream.CROSS_SECTION)
    spans = options.crossfall or CROSSFALL, options.gutter
    crossfall, gutter = (float(rng.uniform(*span)) / 100 for span in spans)
    shape = options.cross_sections[rng.integers(len(options.cross_sections))]
    bend = None if options.bend is None else float(rng.uniform(*options.bend))
    crossfall = 0.0 if shape == "flat" else crossfall
    return replace(spec, cross_section=shape, crossfall=crossfall, gutter=gutter, bend=bend)


def _offset(spec: FrameSpec, right: float, down: float) -> FrameSpec:
    """Return the frame with its principal point moved."""
    column, row = spec.centre
    return replace(spec, principal_point=(column + right, row + down))
