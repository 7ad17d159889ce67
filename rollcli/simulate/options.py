"""What a simulation was asked to be, and what it is unless asked otherwise.

Nothing heavy is imported here, since the command line imports this module to show its help.
"""

from dataclasses import dataclass

SCENES = ("bare", "open", "street", "verge")
CROSS_SECTIONS = ("flat", "crown", "roof", "dish", "superelevated")
ROUGHNESS = ("A", "B", "C", "D", "E")  # of ISO 8608: from new asphalt to a track of gravel
KERBED = ("open", "street")  # the scenes with kerbs
MIXED = "mixed"  # each frame draws one of the scenes, or of the cross sections

FRAMES = 10
SIZE = (640, 480)
FOCAL_PER_WIDTH = 0.58  # the field of view of the KITTI cameras
BASELINE = 0.54
HEIGHT = 1.65
NOISE = 1.5
ROLL_DEG = (-10.0, 10.0)
PITCH_DEG = (-2.0, 6.0)
CROSSFALL = (1.0, 4.0)  # per cent, of roads that are not flat: what road design manuals allow without a bend
GUTTER_WIDTH = 0.35  # metres, at each edge of the carriageway
KERB = (0.10, 0.20)
MAX_DIPS = 12


@dataclass(frozen=True)
class SimulateOptions:
    """What to render, as `rollcli simulate` is asked.

    Ranges are (lowest, highest): `roll_deg` and `pitch_deg`, `curvature` and `bend` in 1/m or None: by scene,
    `crossfall` and `gutter` in per cent, `kerb` and `height` in metres, `principal_offset` in pixels. None
    stands for `CROSSFALL` and `KERB`. `roughness` is one of `ROUGHNESS`, or None: smooth. `dips` is how
    many dips and bumps each road has; None: none, and no true heights. `size` is (width, height) in pixels,
    `focal` in pixels or None: `FOCAL_PER_WIDTH` times the width, `principal_point` (column, row) in pixels or
    None: the image's centre.
    """

    frames: int = FRAMES
    scene: str = MIXED
    roll_deg: tuple[float, float] = ROLL_DEG
    pitch_deg: tuple[float, float] = PITCH_DEG
    curvature: tuple[float, float] | None = None
    bend: tuple[float, float] | None = None
    cross_section: str = "flat"
    crossfall: tuple[float, float] | None = None
    gutter: tuple[float, float] = (0.0, 0.0)
    kerb: tuple[float, float] | None = None
    roughness: str | None = None
    dips: int | None = None
    size: tuple[int, int] = SIZE
    focal: float | None = None
    principal_point: tuple[float, float] | None = None
    principal_offset: tuple[float, float] = (0.0, 0.0)
    baseline: float = BASELINE
    height: tuple[float, float] = (HEIGHT, HEIGHT)
    noise: float = NOISE
    gain: float = 1.0
    grey: bool = False
    seed: int = 0
    resume: bool = False
