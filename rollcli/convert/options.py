"""The options of the conversions. Import-light: the command line loads this to show its help."""

from dataclasses import dataclass, field
from typing import Literal

from rollcli.frames.options import EncodingOptions, InputOptions, PairOptions, RunningOptions
from rollcli.imaging.stereo_options import StereoOptions
from rollcli.rig.options import CalibrationOptions


@dataclass(frozen=True)
class RotationOptions:
    """Where the angles come from: one for all maps, or a result with one for each."""

    roll_deg: float | None
    result: str | None
    expand: bool
    skip_suspect: bool


@dataclass(frozen=True)
class CountOptions:
    """How disparities are counted. None: chosen for each map."""

    bins: int | None = None
    max_disparity: float | None = None
    counts: bool = False


@dataclass(frozen=True)
class DerotateOptions:
    """Every option of `rollcli derotate`."""

    inputs: InputOptions
    rotation: RotationOptions
    output: str
    encoding: EncodingOptions
    running: RunningOptions


@dataclass(frozen=True)
class VDisparityOptions:
    """Every option of `rollcli vdisparity`."""

    inputs: InputOptions
    count: CountOptions
    output: str
    encoding: EncodingOptions
    running: RunningOptions
    calibration: CalibrationOptions = field(default_factory=CalibrationOptions)


@dataclass(frozen=True)
class DisparityOptions:
    """Every option of `rollcli disparity`."""

    inputs: InputOptions
    pairs: PairOptions
    output: str
    save_as: Literal["png", "tiff", "npy"]
    stereo: StereoOptions
    running: RunningOptions
    preview: str | None = None
