"""What a simulation is asked to be, and what it is unless asked otherwise.

Nothing heavy is imported here, since the command line imports this module to show its help.
"""

from dataclasses import dataclass

Span = tuple[float, float]

SCENES = ("bare", "open", "street", "verge")
CROSS_SECTIONS = ("flat", "crown", "roof", "dish", "superelevated")
ROUGHNESS = ("A", "B", "C", "D", "E")  # of ISO 8608: from new asphalt to a track of gravel
KERBED = ("open", "street")  # the scenes with kerbs
MIXED = "mixed"  # each frame draws one of the scenes, or of the cross sections

FOCAL_PER_WIDTH = 0.58  # the field of view of the KITTI cameras
CROSSFALL = (1.0, 4.0)  # per cent, of roads that are not flat: what road design manuals allow without a bend
GUTTER_WIDTH = 0.35  # metres, at each edge of the carriageway
KERB = (0.10, 0.20)
MAX_DIPS = 12


@dataclass(frozen=True)
class SimulateOptions:
    """What to render, as `rollcli simulate` is asked.

    Attributes
    ----------
    frames : int
        Number of pairs.
    scene : str
        One of `SCENES`, or ``mixed``: each frame draws one of them.
    roll_deg, pitch_deg : tuple of float
        Lowest and highest angle, degrees; drawn evenly, as are all ranges.
    curvature : tuple of float or None
        Lowest and highest vertical curvature, 1/m. None: ``bare`` is flat, in the other scenes every second
        frame is flat and the others lie within +-0.001 (a radius of 1 km).
    bend : tuple of float or None
        Lowest and highest horizontal curvature, 1/m. None: ``bare`` is straight, in the other scenes on
        average every second road is straight and the others lie within +-0.004 (a radius of 250 m).
    cross_section : str
        One of `CROSS_SECTIONS`, or ``mixed``: each frame draws one of them.
    crossfall : tuple of float or None
        Lowest and highest slope, per cent; None: `CROSSFALL`. Flat roads have none.
    gutter : tuple of float
        Lowest and highest further slope in the gutters, per cent.
    kerb : tuple of float or None
        Lowest and highest kerb, metres; None: `KERB`.
    roughness : str or None
        One of `ROUGHNESS`; None: a smooth road.
    dips : int or None
        How many dips and bumps each road has; None: none, and no true heights.
    size : tuple of int
        Width and height, pixels.
    focal : float or None
        Pixels; None: `FOCAL_PER_WIDTH` times the width.
    principal_point : tuple of float or None
        Column and row, pixels; None: the image's centre.
    principal_offset : tuple of float
        Lowest and highest offset of the principal point in each direction, pixels.
    baseline : float
        Metres.
    height : tuple of float
        Lowest and highest height of the left camera, metres.
    noise, gain : float
        See `FrameSpec`.
    grey : bool
        One channel instead of three.
    seed : int
    resume : bool
        Keep the frames of an interrupted simulation and do the rest.
    """

    frames: int = 10
    scene: str = MIXED
    roll_deg: Span = (-10.0, 10.0)
    pitch_deg: Span = (-2.0, 6.0)
    curvature: Span | None = None
    bend: Span | None = None
    cross_section: str = "flat"
    crossfall: Span | None = None
    gutter: Span = (0.0, 0.0)
    kerb: Span | None = None
    roughness: str | None = None
    dips: int | None = None
    size: tuple[int, int] = (640, 480)
    focal: float | None = None
    principal_point: tuple[float, float] | None = None
    principal_offset: Span = (0.0, 0.0)
    baseline: float = 0.54
    height: Span = (1.65, 1.65)
    noise: float = 1.5
    gain: float = 1.0
    grey: bool = False
    seed: int = 0
    resume: bool = False
