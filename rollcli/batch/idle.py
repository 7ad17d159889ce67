"""Options without effect on a run of `estimate`."""

from collections.abc import Iterator

from rollcli.batch.options import EstimateOptions
from rollcli.files.stores.locations import is_url
from rollcli.frames.idle import Idle, idle_folders, idle_method, idle_running, idle_stereo

_STEREO = (
    "match",
    "num_disparities",
    "min_disparity",
    "block_size",
    "sgbm_mode",
    "uniqueness",
    "speckle_size",
    "speckle_range",
    "downscale",
    "align",
    "vertical_offset",
)


def idle_in_estimate(options: EstimateOptions) -> Iterator[Idle]:
    """Yield the options without effect on a run of `estimate`."""
    paired = options.pairs.left is not None
    if paired:
        yield Idle(("encoding", "scale", "invalid"), "pairs are matched, and no stored disparities are read")
        yield from idle_stereo(options.stereo)
        if options.images.disparity is None and options.images.derotated is None:
            yield Idle(("save_as",), "only --disparity and --derotated write maps")
    else:
        yield Idle(_STEREO, "the inputs are maps, which are not matched")
        yield Idle(("save_as",), "a map keeps the format of its input")
    yield from idle_method(options.method)
    yield from idle_folders(options.inputs, options.pairs)
    yield from idle_running(options.running)
    if options.result.form != "parquet" and not is_url(options.result.output):
        yield Idle(("part_rows",), "only Parquet and results in an object store have parts")
