"""The errors that cost a frame, not the batch."""

from collections.abc import Callable

import cv2
import numpy as np

from rollcli.errors import EstimationError, InputError, UsageError
from rollcli.run.frame import Frame, FrameResult, failed_frame

_NUMERIC_ERRORS = (ArithmeticError, ValueError)  # from numbers that some step cannot deal with
FRAME_ERRORS = (
    InputError,
    EstimationError,
    UsageError,
    OSError,
    MemoryError,
    cv2.error,
    *_NUMERIC_ERRORS,
)


def guarded(frame: Frame, work: Callable[[], FrameResult]) -> FrameResult:
    """Do the work; turn an error that costs only this frame into its `error` row."""
    try:
        with np.errstate(all="ignore"):  # numbers of damaged maps overflow: the row says what comes of them
            return work()
    except FRAME_ERRORS as error:
        return failed_frame(frame, str(error) or type(error).__name__)
