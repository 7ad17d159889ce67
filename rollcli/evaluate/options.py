"""What the paper's experiments were asked to do; light, since the command line imports it for its help."""

from dataclasses import dataclass

from rollcli.run.options import EncodingOptions, FrameOptions, InputOptions, RegionOptions, RunningOptions


@dataclass(frozen=True)
class AccuracyOptions:
    """Everything that `rollcli evaluate accuracy` was asked.

    Attributes
    ----------
    result, truth : str
        Files: what `rollcli estimate` wrote, and a CSV with `file`, `roll_deg` and, where known, `pitch_deg`
        and `height_m`.
    heights : str or None
        The folder of heights over the road that the run wrote; None: the one that its record names, if it and
        `heights/` beside the truth exist.
    output : str
        A file, or "-" for stdout.
    format : {"table", "csv", "json"}
    running : RunningOptions
    """

    result: str
    truth: str
    heights: str | None
    output: str
    format: str
    running: RunningOptions


@dataclass(frozen=True)
class ExperimentOptions:
    """Where the figures go, and what is varied.

    Attributes
    ----------
    output : str
        A folder.
    turns : tuple of float
        First and last angle that maps are rotated by, and the step; degrees.
    timed : int
        How many maps, from the first, the run times are taken on.
    truth : str or None
        A CSV of known angles.
    figure : str or None
        The kind of the figures for a paper: "svg", "pdf" or "png".
    """

    output: str
    turns: tuple[float, float, float] = (-20.0, 20.0, 2.0)
    timed: int = 3
    truth: str | None = None
    figure: str | None = None

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """Every angle that maps are rotated by, degrees."""
        first, last, step = self.turns
        return tuple(first + step * k for k in range(int((last - first) / step + 1e-9) + 1))


@dataclass(frozen=True)
class PaperOptions:
    """Everything that `rollcli evaluate paper` was asked."""

    inputs: InputOptions
    encoding: EncodingOptions
    region: RegionOptions
    experiments: ExperimentOptions
    running: RunningOptions

    @property
    def frame(self) -> FrameOptions:
        """How a map is read."""
        return FrameOptions(encoding=self.encoding, region=self.region)

    @property
    def has_region(self) -> bool:
        """Whether the user chose the pixels."""
        return self.region != RegionOptions()
