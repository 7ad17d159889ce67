"""The calibration of a rectified stereo pair, and the numbers that win over its file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from rollcli.errors import UsageError
from rollcli.estimator.request import Request


class CalibrationOptions(NamedTuple):
    """Files and numbers of the calibration; each number wins over the files.

    Attributes
    ----------
    calib : tuple of str
        A file, or a folder with one of the same stem each: KITTI, Middlebury, ETH3D, OpenCV, ROS (twice:
        left, right), Cityscapes, ORB-SLAM, DrivingStereo; recognised by content.
    focal : float or None
        Focal length fx, pixels of images of the size that --calib states, else of those given; fy / fx is
        the file's, else 1. [default: the file's]
    principal_point : tuple of float or None
        Optical axis in the left view, pixels as of --focal, from the centre of the top-left one. [default:
        the file's]
    baseline : float or None
        Distance between the cameras, metres; gives the height. [default: the file's]
    doffs : float or None
        CX of the right view less that of the left one, pixels as of --focal. [default: the file's, else 0]
    """

    calib: tuple[str, ...] = ()
    focal: float | None = None
    principal_point: tuple[float, float] | None = None
    baseline: float | None = None
    doffs: float | None = None

    @property
    def given(self) -> bool:
        """Whether anything is said of the calibration."""
        return self != CalibrationOptions()


# px: both sides of a scaled image are rounded to the nearest pixel, down, or up
_ROUNDINGS = (-0.5, 0.0, -1.0)
# no rig reaches these; numbers that do are damage, and their squares can be beyond what a float holds
_FOCAL = (1.0, 1e6)  # px
_PLACE = 1e6  # px from the first pixel
_BASELINE = (1e-4, 1e4)  # m
LIKELY_BASELINE = (0.005, 5.0)  # m: no rig on a vehicle is smaller or larger: another number has another unit
_OFF = 0.12  # as a factor from 1: lenses are centred to a few hundredths, and common scalings are beyond it
_EDGE = 0.1  # of a side: there lies the principal point of twice the size, but hardly that of a crop


@dataclass(frozen=True)
class Calibration:
    """The intrinsics of the rectified left view, and what relates it to the right one.

    Attributes
    ----------
    fx, fy : float
        Focal lengths, px; more than 0.
    cx, cy : float
        Principal point, px from the centre of the top-left pixel.
    baseline : float or None
        Distance between the cameras, metres; None: the pose has a pitch and no height.
    doffs : float
        Column of the right view's principal point less that of the left one's, px:
        depth = fx baseline / (disparity + doffs).
    width, height : int or None
        Size of the image that the numbers are for, px; None where it is not stated.
    source : str
        Where the numbers are from, for messages.
    notes : tuple of str
        What a user should know about how the file was read.

    Raises
    ------
    UsageError
        When the numbers cannot be those of a rig.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    baseline: float | None = None
    doffs: float = 0.0
    width: int | None = None
    height: int | None = None
    source: str = "calibration"
    notes: tuple[str, ...] = ()

    @property
    def aspect(self) -> float:
        """The ratio fy / fx, 1 where pixels are square."""
        return self.fy / self.fx

    def __post_init__(self) -> None:
        for name, value in (("fx", self.fx), ("fy", self.fy)):
            self._require(f"a focal length {name}", value, *_FOCAL, "px")
        for name, value in (("a principal point cx", self.cx), ("a principal point cy", self.cy)):
            self._require(name, value, -_PLACE, _PLACE, "px")
        self._require("a doffs", self.doffs, -_PLACE, _PLACE, "px")
        if self.baseline is not None:
            self._require("a baseline", self.baseline, *_BASELINE, "m")
        if self.width is not None and self.height is not None:
            self.require_inside(self.width, self.height)

    def _require(self, what: str, value: float, least: float, most: float, unit: str) -> None:
        if not least <= value <= most:
            hint = "a positive one" if math.isfinite(value) and value <= 0 < least else "that of a camera"
            raise UsageError(f"{self.source}: {what} of {value:g} {unit}: give {hint}")

    def require_inside(self, width: int, height: int) -> None:
        """Refuse an image of this size that does not hold the principal point.

        Raises
        ------
        UsageError
        """
        if not (0 < self.cx < width and 0 < self.cy < height):
            raise UsageError(
                f"{self.source}: the principal point {self.cx:g},{self.cy:g} lies outside of the "
                f"{width}x{height} image: give the calibration of this size"
            )

    @property
    def at_edge(self) -> bool:
        """Whether the principal point lies so far out that the numbers seem to be of a larger image."""
        if self.width is None or self.height is None:
            return False
        return max((self.cx + 0.5) / self.width, (self.cy + 0.5) / self.height) > 1 - _EDGE

    def right_axis(self, width: int, height: int) -> tuple[float, float]:
        """Return the right view's principal point from the middle of an image of this size, px."""
        return self.cx + self.doffs - (width - 1) / 2, self.cy - (height - 1) / 2

    def seems_of_another_size(self, width: int, height: int) -> str:
        """Say that numbers without a size seem to be of images of another size than this; else empty.

        The principal point is near the middle of an image. Numbers for twice the size have it at the lower
        right corner, those for half the size amid the upper left quarter. A crop moves it too, but hardly by
        one factor across and down.
        """
        if self.width is not None:
            return ""
        across, down = 2 * (self.cx + 0.5) / width, 2 * (self.cy + 0.5) / height
        factor = math.sqrt(across * down)
        if abs(math.log(factor)) < _OFF or abs(math.log(across / down)) > abs(math.log(factor)):
            return ""
        return (
            f"{self.source}: states no image size, and its principal point {self.cx:g},{self.cy:g} is that "
            f"of images of about {2 * self.cx + 1:.0f}x{2 * self.cy + 1:.0f} px; "
            f"these have {width}x{height}: pitch and height are wrong, and the roll may be, unless the "
            "calibration is of this size: give --focal and --principal-point of it"
        )

    def for_size(self, width: int, height: int) -> "Calibration":
        """Return the calibration of the same view at another size.

        Parameters
        ----------
        width, height : int
            Size of the image, px: that of the calibration times one factor, rounded to whole pixels.

        Returns
        -------
        Calibration
            For a calibration without a size, the same numbers with this size.

        Raises
        ------
        UsageError
            The sizes differ by more than one factor, as after a crop, or the principal point lies outside.
        """
        if self.width is None or self.height is None:
            self.require_inside(width, height)
            return replace(self, width=width, height=height)
        if (width, height) == (self.width, self.height):
            return self
        if not one_factor((width, height), (self.width, self.height)):
            raise UsageError(
                f"{self.source}: the calibration is for {self.width}x{self.height} px, the map has "
                f"{width}x{height}: give the calibration of this size; only a scaled image is allowed for"
            )
        across, down = width / self.width, height / self.height
        return replace(
            self,
            fx=self.fx * across,
            fy=self.fy * down,
            cx=(self.cx + 0.5) * across - 0.5,
            cy=(self.cy + 0.5) * down - 0.5,
            doffs=self.doffs * across,
            width=width,
            height=height,
        )


def for_matched(calibration: Calibration, width: int, height: int, downscale: float) -> Calibration:
    """Return the calibration of views that were matched at this size, 1/downscale of the images'.

    Raises
    ------
    UsageError
        See `Calibration.for_size`.
    """
    if calibration.width is None:  # its numbers are for the images as they are
        calibration = calibration.for_size(round(width * downscale), round(height * downscale))
    return calibration.for_size(width, height)


def request_with(calibration: Calibration | None, request: Request) -> Request:
    """Return a request for a map that this is the calibration of; as it is where there is none."""
    if calibration is None:
        return request
    middle = calibration.cx, calibration.cy
    return replace(request, middle=middle, doffs=calibration.doffs, aspect=calibration.aspect)


def require_calibration(calibration: object) -> None:
    """Refuse what is given as a calibration and is none, such as a path.

    Raises
    ------
    UsageError
    """
    if calibration is not None and not isinstance(calibration, Calibration):
        kind = type(calibration).__name__
        raise UsageError(f"what is of type {kind} is no calibration: give rollcli.read_calibration(path)")


def one_factor(size: Sequence[int], of_size: Sequence[int]) -> bool:
    """Whether one factor makes a size, width and height in pixels, of another, rounded to whole pixels."""
    sides = tuple(zip(size, of_size, strict=True))
    return any(
        max((side + below) / of for side, of in sides) < min((side + below + 1) / of for side, of in sides)
        for below in _ROUNDINGS
    )
