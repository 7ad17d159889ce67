"""What is said of views that are not level."""

NOT_LEVELLED = "the views are not level, and could not be levelled"
"""The doubt of a pair whose correction was still changing when it was given up."""
TOO_LITTLE = "too little can be compared to tell whether the views are level"
"""The doubt of a pair whose correction could not be checked."""

NOT_TOLD_BY_ROWS = "the rows do not tell whether the right view is larger or its rows are bent: recalibrate"
"""The doubt of a pair that was levelled, but whose columns may be far from where they are believed to be."""


def advice_of(lower: float, clockwise: float, larger: float, twist: float) -> str:
    """Return what a run says of its rig, in a sentence; empty where nothing is far enough from level.

    Parameters
    ----------
    lower, clockwise, larger, twist : float
        How the right view lies, px, degrees, per cent, and px in the corners.

    Notes
    -----
    An image that is turned clockwise is of a camera that is rolled counter-clockwise, seen from behind.
    """
    parts = []
    if abs(clockwise) >= 0.03:
        way = "counter-clockwise" if clockwise > 0 else "clockwise"
        against = f"against the left, {way} seen from behind"
        parts.append(f"the right camera is rolled by {abs(clockwise):.2f} degrees {against}")
    if abs(lower) >= 0.15:
        parts.append(f"the right image lies {abs(lower):.2f} px {'lower' if lower > 0 else 'higher'}")
    if abs(larger) >= 0.1:
        parts.append(f"the right image is {abs(larger):.2f} % {'larger' if larger > 0 else 'smaller'}")
    if abs(twist) >= 0.5:
        parts.append(f"its rows are skewed by {abs(twist):.1f} px in the corners")
    return ", ".join(parts) + ": recalibrate" if parts else ""
