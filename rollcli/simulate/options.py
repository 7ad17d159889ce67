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
TRUTH = "truth.csv"  # in the folder of a simulation, beside its true disparities and heights


@dataclass(frozen=True, kw_only=True)
class Rendering:
    """What every frame of a simulation has as it is asked for.

    Attributes
    ----------
    roughness : str or None
        Class of the road's unevenness by ISO 8608, along and across, with mended patches and sunken
        tracks; A: new asphalt, C: an old road, E: gravel. Roll, pitch and height are against the
        parabola that fits the lane ahead, below the camera. [default: a smooth road]
    dips : int or None
        Dips and bumps of 2.5 to 7 cm in the lane ahead of each road, and DIR/heights: how high the ground
        lies over the road, metres, float32 TIFF; 0: kerbs and pavements alone. [default: neither]
    size : tuple of int
        Size of the images, pixels.
    principal_point : tuple of float or None
        Column and row of the principal point, pixels from the centre of the top-left pixel. [default: the
        image's centre]
    baseline : float
        Distance of the cameras, metres.
    noise : float
        Noise of the sensor: standard deviation in grey levels of 255.
    gain : float
        Light of the right view relative to the left one; grey levels change with its square root.
    seed : int
        Seed of the random numbers; the same seed gives the same files.
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
        bare: a road alone; open: with kerbs and cars; street: with house fronts too; verge: between grass
        slopes; mixed: each frame one of these.
    roll_deg : tuple of float
        Roll of the rig against the road, degrees, drawn evenly from A to B; positive: its right end is
        up.
    pitch_deg : tuple of float
        Pitch of the rig against the road, degrees, drawn evenly from A to B; positive: it looks down.
    curvature : tuple of float or None
        Curvature along the road, 1/m, drawn evenly from A to B; positive: a sag; negative: a crest.
        [default: half of the frames flat, half within +-0.001; bare is flat]
    bend : tuple of float or None
        Horizontal curvature of the road, 1/m, drawn evenly from A to B; positive: to the right; 0: a
        straight road. [default: half of the roads straight, half within +-0.004; bare is straight]
    cross_section : str
        Shape of the road across. crown, dish: a parabola, highest or lowest in the middle; roof: two
        planes that meet in the middle; superelevated: one plane, its outer side up in a bend; mixed: each
        frame one of these. Roll and pitch are against the plane tangent to the road below the left
        camera.
    crossfall : tuple of float or None
        Slope of a cross section that is not flat, per cent, drawn evenly from A to B; of a crown or dish at
        its edges. [default: 1:4]
    gutter : tuple of float
        How much more the outer 35 cm on each side fall outward, per cent, drawn evenly from A to B.
    kerb : tuple of float or None
        Height of kerbs and pavements (open, street) above the road's edge, metres, drawn evenly from A to
        B. [default: 0.1:0.2]
    focal : float or None
        Focal length, pixels. [default: 0.58 times the width]
    principal_offset : tuple of float
        Offset of the principal point in each direction, pixels, drawn evenly from A to B.
    height : tuple of float
        Height of the left camera above the road, metres, drawn evenly from A to B.
    grey : bool
        Write grey images. [default: colour]
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

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes of which a frame draws one."""
        return SCENES if self.scene == MIXED else (self.scene,)

    @property
    def cross_sections(self) -> tuple[str, ...]:
        """The cross sections of which a frame draws one."""
        return CROSS_SECTIONS if self.cross_section == MIXED else (self.cross_section,)
