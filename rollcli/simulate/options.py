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


@dataclass(frozen=True, kw_only=True)
class Rendering:
    """What every frame of a simulation has as it is asked for.

    Attributes
    ----------
    roughness : str or None
        The class of ISO 8608, one of `ROUGHNESS`; None: a smooth road.
    dips : int or None
        How many dips and bumps the lane ahead has, as far as there is room; None: none, and no true heights.
    size : tuple of int
        Width and height, pixels.
    principal_point : tuple of float or None
        Column and row, pixels from the centre of the top-left pixel; None: the image's centre.
    baseline : float
        Metres.
    noise : float
        Standard deviation of the sensor's noise, grey levels of 255.
    gain : float
        Brightness of the right view relative to the left one.
    seed : int
        The random content is drawn from this and the frame's number.
    """

    roughness: str | None = None
    dips: int | None = None
    size: tuple[int, int] = (640, 480)
    principal_point: tuple[float, float] | None = None
    baseline: float = 0.54
    noise: float = 1.5
    gain: float = 1.0
    seed: int = 0


@dataclass(frozen=True)
class SimulateOptions(Rendering):
    """What to render, as `rollcli simulate` is asked; the rest of a frame is drawn.

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
    focal : float or None
        Pixels; None: `FOCAL_PER_WIDTH` times the width.
    principal_offset : tuple of float
        Lowest and highest offset of the principal point in each direction, pixels.
    height : tuple of float
        Lowest and highest height of the left camera, metres.
    grey : bool
        One channel instead of three.
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
    focal: float | None = None
    principal_offset: Span = (0.0, 0.0)
    height: Span = (1.65, 1.65)
    grey: bool = False
    resume: bool = False
