"""What `evaluate accuracy` and `evaluate paper` were asked to do; import-light, for their help."""

from dataclasses import dataclass

from rollcli.run.options import FramesOptions, RegionOptions, RunningOptions


@dataclass(frozen=True)
class AccuracyOptions:
    """Everything that `rollcli evaluate accuracy` was asked.

    Attributes
    ----------
    result : str
        What `rollcli estimate` wrote.
    truth : str
        The known angles: CSV with the columns file and roll_deg, degrees.
    heights : str or None
        Heights over the road that estimate wrote, compared with heights/ beside the known angles at 5, 10
        and 20 m. [default: where the run of RESULT wrote them, if both exist]
    output : str
        Where the figures go (-: stdout).
    format : {"table", "csv", "json"}
        A table to read, or degrees and shares from 0 to 1 for programs. [default: by FILE's ending, else
        table]
    running : RunningOptions
    """

    result: str
    truth: str
    heights: str | None
    output: str
    format: str
    running: RunningOptions


@dataclass(frozen=True, kw_only=True)
class PaperOptions(FramesOptions):
    """Everything that `rollcli evaluate paper` was asked: which maps, where figures go, what is varied.

    Attributes
    ----------
    output : str
        Where paper.html and its CSVs go.
    turns : tuple of float
        Rotate each map by these angles, degrees.
    timed : int
        Take the run times on the first N maps; the paper's n x 3 form is slow.
    truth : str or None
        Known angles of the maps: CSV with file and roll_deg. [default: each map's own estimate]
    figure : str or None
        Write each chart of the page as a figure, too, as wide as a journal's column (3.5 inches).
    """

    calibrates = False

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

    @property
    def folders(self) -> list[str]:
        """Where the page and the tables go."""
        return [self.output]

    @property
    def has_region(self) -> bool:
        """Whether the user chose the pixels."""
        return self.region != RegionOptions()
