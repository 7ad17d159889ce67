"""The roll angle of a stereo rig, from disparity maps.

The functions below are loaded when first used, so that ``import rollcli`` (and with it
``rollcli --version``) costs nothing.
"""

__version__ = "0.1.0"

TYPE_CHECKING = False  # as type checkers know it, without loading typing
if TYPE_CHECKING:
    from typing import Any

    from rollcli.errors import EstimationError as EstimationError
    from rollcli.errors import InputError as InputError
    from rollcli.errors import RollcliError as RollcliError
    from rollcli.errors import UsageError as UsageError
    from rollcli.estimator.estimate import RollEstimate as RollEstimate
    from rollcli.estimator.interval import Tangent as Tangent
    from rollcli.files.encodings import read_disparity as read_disparity
    from rollcli.files.recordings.open import open_recording as open_recording
    from rollcli.pictures.derotate import derotate as derotate
    from rollcli.pictures.heights import height_map as height_map
    from rollcli.pictures.vdisparity import VDisparity as VDisparity
    from rollcli.pictures.vdisparity import v_disparity as v_disparity
    from rollcli.rig.calibration import Calibration as Calibration
    from rollcli.rig.drive.assess import RigAssessment as RigAssessment
    from rollcli.rig.drive.assess import assess_rig as assess_rig
    from rollcli.run.find import read_calibration as read_calibration
    from rollcli.run.library import estimate_pair as estimate_pair
    from rollcli.run.library import estimate_roll as estimate_roll
    from rollcli.stereo.match import compute_disparity as compute_disparity
    from rollcli.stereo.options import StereoOptions as StereoOptions

_HOMES = {
    "Calibration": "rollcli.rig.calibration",
    "EstimationError": "rollcli.errors",
    "InputError": "rollcli.errors",
    "RigAssessment": "rollcli.rig.drive.assess",
    "RollEstimate": "rollcli.estimator.estimate",
    "RollcliError": "rollcli.errors",
    "StereoOptions": "rollcli.stereo.options",
    "Tangent": "rollcli.estimator.interval",
    "UsageError": "rollcli.errors",
    "VDisparity": "rollcli.pictures.vdisparity",
    "assess_rig": "rollcli.rig.drive.assess",
    "compute_disparity": "rollcli.stereo.match",
    "derotate": "rollcli.pictures.derotate",
    "estimate_pair": "rollcli.run.library",
    "estimate_roll": "rollcli.run.library",
    "height_map": "rollcli.pictures.heights",
    "open_recording": "rollcli.files.recordings.open",
    "read_calibration": "rollcli.run.find",
    "read_disparity": "rollcli.files.encodings",
    "v_disparity": "rollcli.pictures.vdisparity",
}
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> "Any":
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
