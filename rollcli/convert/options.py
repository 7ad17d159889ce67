"""What a conversion was asked to do; light, since the command line imports this to show its help."""

from dataclasses import dataclass
from typing import Literal

from rollcli.frames.options import EncodingOptions, InputOptions, PairOptions, RunningOptions
from rollcli.imaging.stereo_options import StereoOptions


@dataclass(frozen=True)
class TurnOptions:
    """Where the angles come from: one for all, or a result with one for each map."""

    roll_deg: float | None = None
    result: str | None = None
    expand: bool = False


@dataclass(frozen=True)
class CountOptions:
    """How disparities are counted. None: as the map asks for."""

    bins: int | None = None
    max_disparity: float | None = None
    counts: bool = False


@dataclass(frozen=True)
class DerotateOptions:
    """Everything that `rollcli derotate` was asked."""

    inputs: InputOptions
    turn: TurnOptions
    output: str
    encoding: EncodingOptions
    running: RunningOptions


@dataclass(frozen=True)
class VDisparityOptions:
    """Everything that `rollcli vdisparity` was asked."""

    inputs: InputOptions
    count: CountOptions
    output: str
    encoding: EncodingOptions
    running: RunningOptions


@dataclass(frozen=True)
class DisparityOptions:
    """Everything that `rollcli disparity` was asked."""

    inputs: InputOptions
    pairs: PairOptions
    output: str
    save_as: Literal["png", "tiff", "npy"]
    stereo: StereoOptions
    running: RunningOptions
