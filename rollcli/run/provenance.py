"""What a map from a pair carries in its own file: what levelling left, and how the views lay."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from rollcli.files.results import ALIGNMENT_COLUMNS


@dataclass(frozen=True)
class Provenance:
    """How far a map from a pair may be believed.

    Attributes
    ----------
    slope_error : float
        Standard deviation of a slope that all disparities may have beside the road's, px per px.
    doubt : str
        Why the map itself may be wrong; empty when there is no reason.
    alignment : mapping of str to float
        How the right view lay, by column of a result; empty where that could not be told.
    """

    slope_error: float = 0.0
    doubt: str = ""
    alignment: Mapping[str, float] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """One line of ASCII for a file; empty where there is nothing to carry."""
        return "" if self == Provenance() else json.dumps(asdict(self))

    @staticmethod
    def of_text(text: str) -> "Provenance":
        """Read such a line; nothing is known where another program has written or changed it."""
        try:
            carried = json.loads(text)
            error, doubt, lay = float(carried["slope_error"]), carried["doubt"], carried["alignment"]
            alignment = {name: float(lay[name]) for name in ALIGNMENT_COLUMNS if name in lay}
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            return Provenance()
        if not (
            0 <= error < math.inf and isinstance(doubt, str) and all(map(math.isfinite, alignment.values()))
        ):
            return Provenance()
        return Provenance(error, " ".join(doubt.split()), alignment)
