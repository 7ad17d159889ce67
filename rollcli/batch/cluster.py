"""Workers on a Dask cluster: the same frames, sent to an executor elsewhere (extra `cluster`)."""

from collections.abc import Generator, Sequence

from rollcli.batch.job import Frame, Outcome
from rollcli.batch.options import EstimateOptions
from rollcli.batch.signals import Stop
from rollcli.errors import UsageError


def cluster_outcomes(
    frames: Sequence[Frame], options: EstimateOptions, stop: Stop
) -> Generator[Outcome, None, None]:
    """The outcome of each frame, in order, from the workers of a scheduler."""
    raise UsageError("--scheduler is not there yet")
    yield
