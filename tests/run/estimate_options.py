"""The options of a run of `estimate`, as the command line makes them."""

from rollcli.run.options import (
    EncodingOptions,
    EstimateOptions,
    ImageOptions,
    InputOptions,
    MethodOptions,
    PairOptions,
    RegionOptions,
    ResultOptions,
    RunningOptions,
)
from rollcli.stereo.options import StereoOptions

_DEFAULTS = EstimateOptions(
    inputs=InputOptions(),
    pairs=PairOptions(),
    encoding=EncodingOptions(),
    stereo=StereoOptions(),
    region=RegionOptions(),
    method=MethodOptions(),
    images=ImageOptions(),
    result=ResultOptions(),
    running=RunningOptions(),
)


def estimate_options(**given) -> EstimateOptions:
    """Replace some of the defaults, by the names of `EstimateOptions`."""
    return _DEFAULTS._replace(**given)
