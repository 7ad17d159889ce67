"""What a report was asked to be. Light, since the command line imports this to show its help."""

from dataclasses import dataclass, field

from rollcli.files.stores.locations import within
from rollcli.run.options import RunningOptions


@dataclass(frozen=True)
class ReportOptions:
    """Everything that `rollcli report` was asked.

    Attributes
    ----------
    results : tuple of str
        One result, the shards of one run, or results of several.
    output : str or None
        Where the page goes (-: stdout).
    svg : str or None
        Write each chart of the page as an SVG: roll, histogram, and where there are any, pitch, height
        and how the right view lies.
    pdf : str or None
        The same as PDFs.
    png : str or None
        The same as PNGs, 1920 pixels wide.
    images : str or None
        A folder that estimate wrote images to, or the folder above: show these. [default: make them from
        the inputs]
    title : str or None
        Its heading. [default: Roll of N frames]
    gallery : int
        How many frames to show in pictures: those around jumps, the widest intervals, suspect ones, and
        some evenly spread.
    fetch : bool
        Read inputs from whichever server or bucket the result names; else only from the one it lies in.
    running : RunningOptions
    """

    results: tuple[str, ...]
    output: str | None = None
    svg: str | None = None
    pdf: str | None = None
    png: str | None = None
    images: str | None = None
    title: str | None = None
    gallery: int = 12
    fetch: bool = False
    running: RunningOptions = field(default_factory=RunningOptions)

    def chart_paths(self, name: str) -> dict[str, str]:
        """Return where a chart is written, by format."""
        folders = {"svg": self.svg, "pdf": self.pdf, "png": self.png}
        return {kind: within(folder, f"{name}.{kind}") for kind, folder in folders.items() if folder}
