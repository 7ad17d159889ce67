"""What a report was asked to be; light, since the command line imports this to show its help."""

from dataclasses import dataclass, field

from rollcli.frames.options import RunningOptions

GALLERY = 12


@dataclass(frozen=True)
class ReportOptions:
    """Everything that `rollcli report` was asked; `gallery` is how many frames the gallery shows."""

    result: str
    output: str
    images: str | None = None
    title: str | None = None
    gallery: int = GALLERY
    running: RunningOptions = field(default_factory=RunningOptions)
