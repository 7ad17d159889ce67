"""The last line of a run: what its frames say about the rig."""

from array import array

from rollcli.files.results import STATUSES, Row


class RigAnswer:
    """Keeps of each row what the answer needs; a batch has a hundred thousand of them.

    Import-light: the dispatcher loads NumPy only for the answer, once the workers have ended.
    """

    def __init__(self) -> None:
        self._files: list[str] = []
        self._status = bytearray()
        self._rolls, self._halves = array("d"), array("d")

    def add(self, row: Row) -> None:
        """Take a row that is written."""
        self._files.append(row.file)
        self._status.append(STATUSES.index(row.status))
        self._rolls.append(float("nan") if row.roll_deg is None else row.roll_deg)
        self._halves.append(float("nan") if row.roll_ci95_deg is None else row.roll_ci95_deg)

    def replace(self, position: int, row: Row) -> None:
        """Take a row that is written in the place of the one at a position, from 0."""
        self._status[position] = STATUSES.index(row.status)
        self._rolls[position] = float("nan") if row.roll_deg is None else row.roll_deg
        self._halves[position] = float("nan") if row.roll_ci95_deg is None else row.roll_ci95_deg

    def line(self) -> str:
        """Return the answer in one line, such as `roll -0.44 ± 0.06°, 5 ok, 0 suspect, 0 failed`."""
        from rollcli.rig.drive.assess import assess_rig
        from rollcli.rig.words import one_line

        columns = {
            "file": self._files,
            "status": [STATUSES[each] for each in self._status],
            "roll_deg": self._rolls,
            "roll_ci95_deg": self._halves,
        }
        return one_line(assess_rig(columns))
