"""What may be wrong with a frame without being wrong with the batch."""

from collections.abc import Callable

import cv2

from rollcli.errors import EstimationError, InputError, UsageError
from rollcli.frames.frame import Frame, Outcome, failed

_NUMBERS = (ArithmeticError, ValueError)  # that some step cannot deal with
FAULTS = (InputError, EstimationError, UsageError, OSError, MemoryError, cv2.error, *_NUMBERS)


def guarded(frame: Frame, work: Callable[[], Outcome]) -> Outcome:
    """What the work gives, or the row that says what is wrong with this frame."""
    try:
        return work()
    except FAULTS as error:
        return failed(frame, str(error) or type(error).__name__)
