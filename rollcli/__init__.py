"""The roll angle of a stereo rig, from disparity maps.

The functions below are loaded when first used, so that ``import rollcli`` (and with it
``rollcli --version``) costs nothing.
"""

__version__ = "0.1.0"

TYPE_CHECKING = False  # as type checkers know it, without loading typing
if TYPE_CHECKING:
    from rollcli.errors import EstimationError as EstimationError
    from rollcli.errors import InputError as InputError
    from rollcli.errors import RollcliError as RollcliError
    from rollcli.errors import UsageError as UsageError
    from rollcli.estimator.estimate import RollEstimate as RollEstimate
    from rollcli.estimator.interval import Tangent as Tangent
    from rollcli.files.encodings import read_disparity as read_disparity
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
    from rollcli.run.library import open_recording as open_recording
    from rollcli.stereo.match import compute_disparity as compute_disparity
    from rollcli.stereo.options import StereoOptions as StereoOptions
else:  # a checker is told by the imports above which names there are
    _NAMES = {
        "rollcli.errors": "EstimationError InputError RollcliError UsageError",
        "rollcli.estimator.estimate": "RollEstimate",
        "rollcli.estimator.interval": "Tangent",
        "rollcli.files.encodings": "read_disparity",
        "rollcli.pictures.derotate": "derotate",
        "rollcli.pictures.heights": "height_map",
        "rollcli.pictures.vdisparity": "VDisparity v_disparity",
        "rollcli.rig.calibration": "Calibration",
        "rollcli.rig.drive.assess": "RigAssessment assess_rig",
        "rollcli.run.find": "read_calibration",
        "rollcli.run.library": "estimate_pair estimate_roll open_recording",
        "rollcli.stereo.match": "compute_disparity",
        "rollcli.stereo.options": "StereoOptions",
    }
    _HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}
    __all__ = ["__version__", *sorted(_HOMES)]

    def __getattr__(name: str) -> object:
        if name in _HOMES:
            from importlib import import_module

            return getattr(import_module(_HOMES[name]), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__() -> list[str]:
        return sorted(__all__)
