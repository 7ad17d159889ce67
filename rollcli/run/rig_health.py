"""How the views of a pair lie over a drive, what that does to roll and depth, and the correction for it."""

import math
from dataclasses import dataclass

import numpy as np

from rollcli.rig.calibration import Calibration
from rollcli.rig.drive.assess import RigAssessment
from rollcli.rig.drive.posterior import Estimate
from rollcli.rig.quantities import ALIGNMENT, SIZE, Quantity
from rollcli.rig.words import answer
from rollcli.stereo.misalignment import Misalignment

PIXELS = Quantity("shift", "", "", " px", "px")
NOT_SEEN = "not seen in rows: constant vergence and baseline"
DISTANCES = (10, 20, 50)  # m


@dataclass(frozen=True, slots=True)
class HealthTuning:
    """Limits between verdicts, with what is seen of rendered pairs.

    Attributes
    ----------
    level : float
        Largest vertical shift in the image of views that are level, px. Level rendered pairs measure up to
        0.2.
    enough : float
        Largest one that rollcli corrects without a loss, px; matchers without correction lose a quarter of a
        degree of roll from half a pixel on.
    roll_per_px : float
        By how much a road turns at most for a vertical shift of one pixel that nobody corrects, degrees.
    """

    level: float = 0.3
    enough: float = 1.0
    roll_per_px: float = 0.5


TUNING = HealthTuning()


@dataclass(frozen=True, slots=True)
class Health:
    """How the right view lies over the last drive that has pairs.

    Attributes
    ----------
    frames : int
        Pairs that were measured.
    parts : tuple of Estimate
        In the order of `ALIGNMENT`: px, degrees, per cent, px in the corners.
    size : tuple of int
        Width and height of the views, px.
    reach : Estimate
        The largest vertical shift in the image, px.
    calibration : Calibration or None
    """

    frames: int
    parts: tuple[Estimate, ...]
    size: tuple[int, int]
    reach: Estimate
    calibration: Calibration | None = None

    @property
    def misalignment(self) -> Misalignment:
        """The parts as the views are levelled by."""
        width, height = self.size
        return Misalignment.of_values([each.value or 0.0 for each in self.parts], height, width)

    @property
    def verdict(self) -> str:
        """One of three: level, level enough for rollcli, recalibrate; by the shift that is surely there."""
        surely = (self.reach.value or 0.0) - (self.reach.ci95 or 0.0)
        if surely <= TUNING.level:
            return "level"
        return "level enough for rollcli" if surely <= TUNING.enough else "recalibrate"

    def depth_percent(self, distance: float) -> float | None:
        """Return by how much depth errs at a distance, per cent; None without a baseline.

        Notes
        -----
        A disparity that errs by e puts a point at Z off by Z e / (f B) of its depth. A right view that is
        turned or larger moves points along the rows too, most in the corners.
        """
        if self.calibration is None or self.calibration.baseline is None:
            return None
        width, height = self.size
        lies = self.misalignment
        shift = abs(lies.rotation) * height / 2 + abs(lies.scale) * width / 2
        return 100 * distance * shift / (self.calibration.fx * self.calibration.baseline)

    @property
    def summary(self) -> str:
        """The verdict, with how far the right view is off."""
        off = answer(self.reach, PIXELS).lstrip("+")
        return f"{self.verdict}: up to {off} off in the image ({self.frames:,} pairs)"

    @property
    def effect(self) -> str:
        """What the misalignment would do to the roll, and to depth where a calibration tells."""
        turned = TUNING.roll_per_px * (self.reach.value or 0.0)
        percents = {each: self.depth_percent(each) for each in DISTANCES}
        depths = [f"{off:.1f} % at {each} m" for each, off in percents.items() if off is not None]
        depth = f" and depth in the corners would err by {', '.join(depths)}" if depths else ""
        return f"uncorrected, it would turn the roll by up to {turned:.2f}°{depth}"

    def table(self) -> list[tuple[str, str]]:
        """Return what each part is called, and its value with its interval."""
        words = ("px lower", "degrees clockwise", "% larger", "px twisted in the corners")
        values = (answer(each, PIXELS).removesuffix(" px") for each in self.parts)
        return list(zip(words, values, strict=True))

    def lines(self) -> list[str]:
        """Return the sentences of the table and of stderr."""
        parts = [f"{value} {what}" for what, value in self.table()]
        return [
            f"pair    {self.summary}",
            f"        the right view lies {', '.join(parts)}",
            f"        {self.effect}; {NOT_SEEN}",
        ]


def health_of(rig: RigAssessment, calibration: Calibration | None = None) -> Health | None:
    """Return the health of the pair as it is at the end; None where no pair was measured."""
    drive = rig.latest_drive(ALIGNMENT[0])
    if drive is None:
        return None
    found = [drive.quantities[each.name] for each in ALIGNMENT if each.name in drive.quantities]
    if len(found) < len(ALIGNMENT) or any(each.now.value is None for each in found):
        return None
    sizes = [rig.frames.numbers.get(name, np.empty(0))[drive.frames] for name in SIZE]
    if any(not np.isfinite(each).any() for each in sizes):
        return None
    width, height = (int(each[np.isfinite(each)][-1]) for each in sizes)
    parts = tuple(each.now for each in found)
    return Health(found[0].used, parts, (width, height), _reach(parts, width, height), calibration)


def _reach(parts: tuple[Estimate, ...], width: int, height: int) -> Estimate:
    """Return the largest shift of the four corners, its interval that of a sum of independent parts."""
    values = [each.value or 0.0 for each in parts]
    value = Misalignment.of_values(values, height, width).reach(height, width)
    halves = [each.ci95 for each in parts]
    if None in halves:
        return Estimate(value)
    lower, clockwise, larger, twist = (half or 0.0 for half in halves)
    shifts = Misalignment.of_values((lower, clockwise, larger, twist), height, width).shifts(height, width)
    return Estimate(value, math.hypot(*shifts))
