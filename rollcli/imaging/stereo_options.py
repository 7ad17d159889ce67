"""How pairs are matched; without OpenCV, so that a command line can be read without it."""

from dataclasses import dataclass

from rollcli.errors import UsageError

MODES = ("sgbm", "hh", "3way")


@dataclass(frozen=True)
class StereoOptions:
    """How pairs are matched; disparities in pixels of the size matched at.

    Attributes
    ----------
    num_disparities : int or None
        Width of the range searched, rounded up to a multiple of 16; None: found from the pair itself.
    min_disparity : int
        Where the range starts.
    block_size : int
        Side of the matched block, odd.
    mode : {"sgbm", "hh", "3way"}
        OpenCV's variants: five directions, eight (slow, much memory), three (fast).
    uniqueness : int
        Per cent by which the best match must win.
    speckle_size : int
        Smaller islands of disparity are removed, pixels; 0 keeps all.
    speckle_range : int
        Disparity step that ends an island, pixels.
    downscale : float
        Match at 1/downscale of the size.
    """

    num_disparities: int | None = None
    min_disparity: int = 0
    block_size: int = 5
    mode: str = "sgbm"
    uniqueness: int = 10
    speckle_size: int = 100
    speckle_range: int = 2
    downscale: float = 1.0

    def __post_init__(self) -> None:
        if self.num_disparities is not None and self.num_disparities < 1:
            raise UsageError(f"num-disparities {self.num_disparities}: must be at least 1")
        if self.block_size < 1 or self.block_size % 2 == 0:
            raise UsageError(f"block-size {self.block_size}: must be odd and positive")
        if self.mode not in MODES:
            raise UsageError(f"sgbm-mode {self.mode!r}: choose one of {', '.join(MODES)}")
        if not self.downscale >= 1:
            raise UsageError(f"downscale {self.downscale}: must be at least 1")
