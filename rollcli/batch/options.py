"""The options of a run of `estimate`. Import-light: the command line loads this to show its help."""

from typing import Literal, NamedTuple

from rollcli.frames.options import (
    EncodingOptions,
    FrameOptions,
    ImageOptions,
    InputOptions,
    MethodOptions,
    PairOptions,
    RegionOptions,
    RunningOptions,
)
from rollcli.imaging.stereo_options import StereoOptions
from rollcli.rig.options import CalibrationOptions


class ResultOptions(NamedTuple):
    """Where the rows go, and which frames they are of. `shard` is (I, N), I from 1."""

    output: str = "-"
    format: Literal["csv", "jsonl", "parquet"] | None = None
    resume: bool = False
    retry_failed: bool = False
    shard: tuple[int, int] = (1, 1)
    fail_fast: bool = False
    timing: bool = False
    part_rows: int = 1000

    @property
    def form(self) -> Literal["csv", "jsonl", "parquet"]:
        """The format of the rows: the one given, else by the ending of the output."""
        if self.format is not None:
            return self.format
        lower = self.output.lower().rstrip("/")
        if lower.endswith((".jsonl", ".ndjson")):
            return "jsonl"
        return "parquet" if lower.endswith(".parquet") else "csv"


class EstimateOptions(NamedTuple):
    """Every option of `rollcli estimate`."""

    inputs: InputOptions
    pairs: PairOptions
    encoding: EncodingOptions
    stereo: StereoOptions
    region: RegionOptions
    method: MethodOptions
    images: ImageOptions
    result: ResultOptions
    running: RunningOptions
    calibration: CalibrationOptions = CalibrationOptions()

    @property
    def frame(self) -> FrameOptions:
        """The part that decides the row and the images of a frame."""
        return FrameOptions(
            self.encoding, self.stereo, self.region, self.method, self.images, self.running.root
        )
