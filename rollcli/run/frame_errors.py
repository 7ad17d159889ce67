"""The errors that cost a frame, not the batch."""

import traceback
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
        return frame_of_error(frame, error)


def frame_of_error(frame: Frame, error: Exception) -> FrameResult:
    """Make the row of a frame that an error has cost."""
    return failed_frame(frame, str(error) or type(error).__name__, _cause_of(error))


def _cause_of(error: BaseException | None) -> str:
    """Return what errors of one cause share: where they, and what led to them, were raised, and why."""
    places = []
    while error is not None:
        *_, (frame, line) = traceback.walk_tb(error.__traceback__)
        why = getattr(error, "code", "") or getattr(error, "errno", "")
        places.append(f"{type(error).__name__} {why} {frame.f_code.co_filename}:{line}")
        error = error.__cause__
    return " of ".join(places)
