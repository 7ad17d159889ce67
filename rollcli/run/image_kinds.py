"""The kinds of images that are written for a frame, each with its own folder: the one table of them.

Import-light: the command line loads this module to show its help. How each is made, `encode` says.
"""

from typing import Literal, NamedTuple

Save = Literal["png", "tiff", "npy"]
ENDING_OF_FORMAT: dict[Save, str] = {"png": ".png", "tiff": ".tif", "npy": ".npy"}


class ImageKind(NamedTuple):
    """A kind of image.

    Attributes
    ----------
    name : str
        Its field of `ImageOptions`, its option with "-" for "_", and the usual name of its folder.
    holds : str
        "picture": an 8-bit PNG to look at; "map": disparities as `--save-as` says; "as input": the same, but
        in the input's own type and format where that is a map; "numbers": float32, TIFF or NPY.
    help : str
        Of its option.
    """

    name: str
    holds: Literal["picture", "map", "as input", "numbers"]
    help: str

    def ending(self, save_as: Save, *, computed: bool) -> str | None:
        """Return the ending of its files, None for that of the input; `computed`: from a pair."""
        if self.holds == "picture":
            return ENDING_OF_FORMAT["png"]
        if self.holds == "numbers":
            return ENDING_OF_FORMAT["tiff" if save_as == "png" else save_as]
        return None if self.holds == "as input" and not computed else ENDING_OF_FORMAT[save_as]

    def can_overflow(self, save_as: Save, *, computed: bool) -> bool:
        """Tell whether a TIFF takes its place where a KITTI PNG cannot hold the map."""
        return computed and save_as == "png" and self.holds in ("map", "as input")


KINDS = (
    ImageKind("derotated", "as input", "The map rotated upright; type and format of the input."),
    ImageKind(
        "vdisparity",
        "picture",
        "v-disparity of the map rotated upright, with the road, PNG; vdisparity draws maps as they are.",
    ),
    ImageKind("disparity", "map", "The disparity map that was computed from a pair."),
    ImageKind("road_mask", "picture", "The found road, drawn on the left image of a pair or the map, PNG."),
    ImageKind(
        "heights",
        "numbers",
        "Heights over the road, float32 TIFF (--save-as npy: NPY): metres with a calibration that has a "
        "baseline, else camera heights; NaN where there is no disparity.",
    ),
    ImageKind(
        "heights_preview",
        "picture",
        "Heights over the road to look at, over the left image of a pair, PNG; every frame in the same "
        "colours.",
    ),
)
