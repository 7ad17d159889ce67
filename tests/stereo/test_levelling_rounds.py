"""How often a pair is matched until its views are level, with matches and measurements that are known."""

import numpy as np
import pytest

from rollcli.stereo import match as stereo
from rollcli.stereo.alignment import Measured
from rollcli.stereo.first_look import FirstLook
from rollcli.stereo.misalignment import Misalignment
from rollcli.stereo.misalignment_words import NOT_LEVELLED
from rollcli.stereo.sgbm import ALL_ROWS

SHAPE = (200, 300)


SURE = Misalignment(0.001, 1e-6, 1e-6, 1e-9)


def lies(*values, error=0.0):
    return Measured(Misalignment(*values), Misalignment(error) if error else SURE, 0.5, 0.1, None)


class Rig:
    """A rig that lies off by so much; each map hides a share of what it was not levelled by."""

    def __init__(self, offset, hidden=0.0, tells=True):
        self.offset, self.hidden, self.tells = offset, hidden, tells
        self.matched, self.measured, self.shape = [], [], SHAPE

    @property
    def closer(self):
        return self

    def match(self, at, rows):
        self.matched.append((round(at.offset, 3), rows))
        return np.full(SHAPE, len(self.matched), np.float32)

    def measure(self, disparity, at, rounds):
        self.measured.append((int(disparity[0, 0]), rounds))
        seen = self.offset(at.offset) if callable(self.offset) else self.offset
        return lies(seen - self.hidden * (seen - at.offset)) if self.tells else None

    def run(self, monkeypatch, look=None, rows=ALL_ROWS, any_scene=False):
        self.checked = 0

        def check(*_):
            self.checked += 1

        monkeypatch.setattr(stereo, "check_same_scene", check)
        disparity, corrected, self.told, doubt = stereo._match_levelled(
            self.match, rows, self, FirstLook(20, look), any_scene
        )
        assert disparity[0, 0] == len(self.matched)  # the map of the last match
        return round(corrected.offset, 3), doubt


def test_a_pair_that_runs_away_is_given_up_after_four_matches(monkeypatch):
    rig = Rig(lambda at: at + 1.0)
    corrected, doubt = rig.run(monkeypatch, lies(0.0))
    assert doubt == NOT_LEVELLED
    assert len(rig.matched) == 4
    assert corrected == rig.matched[-1][0]  # what was matched, not what would be tried next


def test_a_pair_that_a_look_led_astray_is_matched_as_it_is_too(monkeypatch):
    rig = Rig(lambda at: at + 1.0 if at else 0.0)
    assert rig.run(monkeypatch, lies(3.0)) == (0, "")
    assert [round(at) for at, _ in rig.matched] == [3, 4, 0]


@pytest.mark.parametrize(
    ("look", "offset", "whole"), [(3.0, 3.0, False), (3.0, 3.4, True), (None, 0.0, True)]
)
def test_a_few_rows_are_enough_where_they_confirm_the_look(monkeypatch, look, offset, whole):
    rig, rows = Rig(offset), slice(100, 150)
    found = rig.run(monkeypatch, None if look is None else lies(look), rows=rows)
    assert rig.matched[0] == (look or 0, rows)
    assert all(needed == ALL_ROWS for _, needed in rig.matched[1:])
    assert (len(rig.matched) > 1) == whole
    assert found == (offset, "")
