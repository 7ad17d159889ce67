"""What may be wrong with a frame without being wrong with the batch."""

from collections.abc import Callable

import cv2
import numpy as np

from rollcli.batch.job import Frame, Outcome, failed
from rollcli.errors import EstimationError, InputError, UsageError

FAULTS = (InputError, EstimationError, UsageError, OSError, MemoryError, cv2.error, np.linalg.LinAlgError)


def guarded(frame: Frame, work: Callable[[], Outcome]) -> Outcome:
    """What the work gives, or the row that says what is wrong with this frame."""
    try:
        return work()
    except FAULTS as error:
        return failed(frame, str(error) or type(error).__name__)
