"""What `rollcli rig` was asked. Import-light: the command line imports this module to show its help."""

from dataclasses import dataclass, field

from rollcli.rig.calibration import CalibrationOptions
from rollcli.run.options import RunningOptions


@dataclass(frozen=True)
class GateOptions:
    """What the rig must be; None where nothing is asked.

    Attributes
    ----------
    expect_roll, expect_pitch : float or None
        Degrees.
    expect_height : float or None
        Metres.
    within : float or None
        How far from them the rig may be, degrees; of the height metres, unless `within_height` is given.
    within_height : float or None
        Metres.
    max_drift, max_jump : float or None
        Of the roll, degrees; the drift over a drive.
    max_misalignment : float or None
        Largest vertical shift between the views in the image, px.
    min_ok : float or None
        Share of the frames that are ok, 0 to 1.
    """

    expect_roll: float | None = None
    expect_pitch: float | None = None
    expect_height: float | None = None
    within: float | None = None
    within_height: float | None = None
    max_drift: float | None = None
    max_jump: float | None = None
    max_misalignment: float | None = None
    min_ok: float | None = None


@dataclass(frozen=True)
class RigOptions:
    """Everything that `rollcli rig` was asked.

    Attributes
    ----------
    results : tuple of str
        One result or several, or the shards of one run.
    against : str or None
        A later result to compare with.
    include_suspect : bool
    groups : str
        "auto", "none" or a pattern of folders.
    output, format : str
    correction : str or None
        Where to write how the right view has to be corrected.
    calibration : CalibrationOptions
        For what a misalignment does to depth.
    gates : GateOptions
    running : RunningOptions
    """

    results: tuple[str, ...]
    against: str | None = None
    include_suspect: bool = False
    groups: str = "auto"
    output: str = "-"
    format: str = "table"
    correction: str | None = None
    calibration: CalibrationOptions = field(default_factory=CalibrationOptions)
    gates: GateOptions = field(default_factory=GateOptions)
    running: RunningOptions = field(default_factory=RunningOptions)
