"""What rows that were measured say of the columns, and disparities that are put right by it.

Views are warped by all that their rows show, for the match needs rows that agree. A scale of the rows is in
the columns only as far as it is supported, and the rest of it is taken out of the disparities again. A yaw
moves the columns by t x^2 where it moves the rows by t x y, and a pitch by q x y where it moves the rows by
q y^2.
"""

import numpy as np

from rollcli.stereo.misalignment import NOTHING_KNOWN, ColumnSupport, Misalignment
from rollcli.stereo.views import Map


def with_believed_columns(disparity: Map, matched: Misalignment, support: ColumnSupport) -> Map:
    """Return the map of a pair whose columns lie as is believed.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Of views of which the right one was levelled by `matched`, px; no data is 0.
    matched : Misalignment
        Pixels of this size.
    support : ColumnSupport
        What is in the columns.
    """
    if support == NOTHING_KNOWN and not matched.scale:
        return disparity
    height, width = disparity.shape
    u = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
    v = np.arange(height, dtype=np.float32)[:, None] - np.float32((height - 1) / 2)
    x = u - disparity
    moved = x * np.float32(support.twist)
    moved += np.float32(support.pitch) * v + np.float32(support.scale - matched.scale)
    moved *= x
    moved += disparity
    np.maximum(moved, np.float32(1e-3), out=moved)
    moved *= disparity > 0
    return moved
