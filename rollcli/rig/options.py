"""What a user says of the calibration: a frozen record, filled by the command line."""

from typing import NamedTuple


class CalibrationOptions(NamedTuple):
    """Files and numbers of the calibration; each number wins over the files.

    `calib` names a file, a folder, or the left and the right file of ROS; `focal` and `doffs` are in px,
    `principal_point` is (cx, cy) in px, `baseline` in metres.
    """

    calib: tuple[str, ...] = ()
    focal: float | None = None
    principal_point: tuple[float, float] | None = None
    baseline: float | None = None
    doffs: float | None = None

    @property
    def given(self) -> bool:
        """Whether anything is said of the calibration."""
        return self != CalibrationOptions()
