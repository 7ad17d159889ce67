"""Do the two images of a pair show the same scene, and is the left one left?

What has texture and is seen by both cameras finds its match. In level pairs, and in pairs 0.8 degrees,
0.8 % and 4 px off, 46 to 84 % of the textured blocks tell how the right view lies; in swapped and unrelated
images 0 to 22 % do (26 rendered, 24 real pairs).
"""

import numpy as np

from rollcli.errors import InputError
from rollcli.imaging.alignment import SmallViews
from rollcli.imaging.first_look import FirstLook, first_look
from rollcli.imaging.vertical_disparity import Measured, textured_share

# Shares of the textured blocks that tell
_SURE = 0.3  # from here on the images are what they should be
_FEW = 0.2  # below it, they show two scenes
_PLAIN = 0.4  # from here on swapped images are swapped
_LEAST_TEXTURE = 0.07  # share of the blocks; images with less may show the same scene


def check_same_scene(small: SmallViews, look: FirstLook, measured: Measured | None) -> None:
    """See that the images show one scene from the left and from the right.

    Parameters
    ----------
    small : SmallViews
    look : FirstLook
        What was seen before the match.
    measured : Measured or None
        How the right view lies, as far as the match tells.

    Raises
    ------
    InputError
        They are one image, are swapped, or show two scenes.
    """
    matched = max(_share(look.measured), _share(measured))
    if matched >= _SURE:
        return  # most pairs: their texture need not be looked at
    textured = min(map(textured_share, small.views))
    if textured < _LEAST_TEXTURE or matched >= _SURE * textured:
        return
    if np.array_equal(*small.views):
        raise InputError("the left and the right image are the same")
    if _share(first_look(small.swapped()).measured) >= _PLAIN * textured:
        raise InputError(
            "the views seem swapped: the scene is matched when the right image is taken for the left one"
        )
    if matched < _FEW * textured:
        raise InputError(
            "the two images do not show the same scene: hardly anything in one is found in the other"
        )


def _share(measured: Measured | None) -> float:
    return 0.0 if measured is None else measured.share
