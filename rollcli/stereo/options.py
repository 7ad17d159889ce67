"""How pairs are matched; without OpenCV, so that a command line can be read without it."""

import os
from dataclasses import dataclass, replace
from functools import cached_property

from rollcli.errors import UsageError
from rollcli.stereo.correction import Correction, read_correction
from rollcli.stereo.misalignment import Misalignment

MODES = ("sgbm", "hh", "3way")
ALIGN = ("auto", "off")
_LARGEST = 2000  # px: OpenCV stores sixteenths in 16 bits
_LIMITS = {
    "num_disparities": (1, _LARGEST),
    "min_disparity": (-_LARGEST, _LARGEST),
    "block_size": (1, 21),  # larger ones overflow OpenCV's sums of costs
    "uniqueness": (0, 99),  # at 100 OpenCV divides by zero
    "speckle_size": (0, 10**6),
    "speckle_range": (0, 1000),
    "downscale": (1, 64),
    "vertical_offset": (-100, 100),
}
_NOT_WHOLE = ("downscale", "vertical_offset")


@dataclass(frozen=True)
class StereoOptions:
    """How pairs are matched; disparities in pixels of the size matched at.

    Attributes
    ----------
    num_disparities : int or None
        Width of the searched range, pixels, rounded up to a multiple of 16; by default found from each
        pair.
    min_disparity : int
        Smallest disparity searched, pixels.
    block_size : int
        Side of the matched block, pixels, odd.
    mode : {"3way", "sgbm", "hh"}
        OpenCV's variants: 3way: three directions (fast, and on real roads the nearest to lidar); sgbm: five;
        hh: eight (slow, much memory).
    uniqueness : int
        Margin by which the best match must win, percent.
    speckle_size : int
        Drop patches of up to this many pixels; 0: keep all.
    speckle_range : int
        Disparity step within a patch, pixels.
    downscale : float
        Match at 1/F of the size; maps, regions of them and pixel columns refer to that size.
    align : {"auto", "off"} or path
        auto: measure how much lower, larger and how far turned the right image is against the left,
        correct that before matching, and say so in the row; off: match the images as they are; FILE:
        correct all pairs as `rollcli rig --correction FILE` says, each by its own offset as far as the
        drive leaves it open.
    vertical_offset : float or None
        How much lower the right image lies, pixels of the size matched at: corrected as given, and
        nothing is measured; by default as --align says.

    Raises
    ------
    UsageError
        A value is out of its range, or `align` names no correction.
    """

    num_disparities: int | None = None
    min_disparity: int = 0
    block_size: int = 5
    mode: str = "3way"
    uniqueness: int = 10
    speckle_size: int = 100
    speckle_range: int = 2
    downscale: float = 1.0
    align: str | os.PathLike[str] | Correction = "auto"
    vertical_offset: float | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in _LIMITS.items():
            value = getattr(self, name)
            if value is None and getattr(type(self), name) is None:
                continue
            if name not in _NOT_WHOLE and not hasattr(value, "__index__"):
                raise UsageError(f"{name.replace('_', '-')} {value}: must be a whole number")
            if not low <= value <= high:
                raise UsageError(f"{name.replace('_', '-')} {value}: must be from {low} to {high}")
        if self.block_size % 2 == 0:
            raise UsageError(f"block-size {self.block_size}: must be odd")
        if self.mode not in MODES:
            raise UsageError(f"sgbm-mode {self.mode!r}: choose one of {', '.join(MODES)}")
        _ = self.correction  # refuses what is none

    @cached_property
    def correction(self) -> Correction | None:
        """What the file that `align` names says, or what was read of it before; None where it names none.

        Raises
        ------
        UsageError
            It cannot be read, or is no correction.
        """
        if isinstance(self.align, Correction):
            return self.align
        return None if self.align in ALIGN else read_correction(str(self.align))

    def given_alignment(self, width: int, height: int) -> Correction:
        """Return how the right view lies as the user says, of views of this size.

        Raises
        ------
        UsageError
            The user says it of views of another shape.
        """
        if self.vertical_offset is not None or (given := self.correction) is None:
            return Correction(Misalignment(float(self.vertical_offset or 0)), None, 0.0, width, height)
        return given.resized(width, height)

    @cached_property
    def is_default(self) -> bool:
        """Whether the match itself is left to the program."""
        return replace(self, downscale=1.0, align="auto", vertical_offset=None) == StereoOptions()

    def for_smaller(self, factor: int) -> "StereoOptions":
        """Return these options for views `factor` times smaller."""
        return replace(self, speckle_size=self.speckle_size // factor**2)

    @property
    def checks_alignment(self) -> bool:
        """Whether what a file says is compared with what the views show."""
        return self.vertical_offset is None and self.align not in ALIGN

    @property
    def measures_alignment(self) -> bool:
        """Whether the views are levelled by what they show."""
        return self.align == "auto" and self.vertical_offset is None
