"""What a report was asked to be. Light, since the command line imports this to show its help."""

from dataclasses import dataclass, field

from rollcli.run.options import RunningOptions

GALLERY = 12


@dataclass(frozen=True)
class ReportOptions:
    """Everything that `rollcli report` was asked.

    `results` are one result, the shards of one run, or results of several; `output` is the page, `svg`, `pdf`
    and `png` are folders for its charts; `gallery` is how many frames the page shows in pictures; `fetch`
    follows rows to any store.
    """

    results: tuple[str, ...]
    output: str | None = None
    svg: str | None = None
    pdf: str | None = None
    png: str | None = None
    images: str | None = None
    title: str | None = None
    gallery: int = GALLERY
    fetch: bool = False
    running: RunningOptions = field(default_factory=RunningOptions)

    def chart_paths(self, name: str) -> dict[str, str]:
        """Return where a chart is written, by format."""
        folders = {"svg": self.svg, "pdf": self.pdf, "png": self.png}
        return {kind: f"{folder.rstrip('/')}/{name}.{kind}" for kind, folder in folders.items() if folder}
