"""What rows that were measured say of the columns, and disparities that are put right by it.

Views are warped by all that their rows show, for the match needs rows that agree. A scale of the rows is in
the columns only as far as it is supported; the rest of it is taken out of the disparities again.
"""

import numpy as np

from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.row_fit import ScaleSupport
from rollcli.stereo.views import Map


def with_believed_columns(disparity: Map, matched: Misalignment, support: ScaleSupport) -> Map:
    """Return the map of a pair whose columns lie as is believed.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Of views of which the right one was levelled by `matched`, px; no data is 0.
    matched : Misalignment
        Pixels of this size.
    support : ScaleSupport
        What of its scale is in the columns.
    """
    surplus = np.float32(support.scale - matched.scale)
    if not surplus:
        return disparity
    width = disparity.shape[1]
    x = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
    moved = disparity + surplus * (x - disparity)
    return np.where(disparity > 0, np.maximum(moved, np.float32(1e-3)), np.float32(0))
