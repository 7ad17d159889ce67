"""What a simulation was asked to be, and what it is unless asked otherwise.

Nothing heavy is imported here, since the command line imports this module to show its help.
"""

from dataclasses import dataclass

SCENES = ("bare", "open", "street", "verge")
MIXED = "mixed"  # each frame draws one of the scenes

FRAMES = 10
SIZE = (640, 480)
FOCAL_PER_WIDTH = 0.58  # the field of view of the KITTI cameras
BASELINE = 0.54
HEIGHT = 1.65
NOISE = 1.5
ROLL_DEG = (-10.0, 10.0)
PITCH_DEG = (-2.0, 6.0)


@dataclass(frozen=True)
class SimulateOptions:
    """What to render, as `rollcli simulate` is asked.

    `roll_deg` and `pitch_deg` are (lowest, highest), `curvature` the same in 1/m, or None: by scene;
    `size` is (width, height) in pixels; `focal` in pixels or None: `FOCAL_PER_WIDTH` times the width.
    """

    frames: int = FRAMES
    scene: str = MIXED
    roll_deg: tuple[float, float] = ROLL_DEG
    pitch_deg: tuple[float, float] = PITCH_DEG
    curvature: tuple[float, float] | None = None
    size: tuple[int, int] = SIZE
    focal: float | None = None
    baseline: float = BASELINE
    height: float = HEIGHT
    noise: float = NOISE
    gain: float = 1.0
    grey: bool = False
    seed: int = 0
