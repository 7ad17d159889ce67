"""How often a pair is matched until its views are level, with matches and measurements that are known."""

import numpy as np

from rollcli.stereo import match as stereo
from rollcli.stereo.alignment import Measured
from rollcli.stereo.first_look import FirstLook
from rollcli.stereo.misalignment import Misalignment

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

    def match(self, at):
        self.matched.append(round(at.offset, 3))
        return np.full(SHAPE, len(self.matched), np.float32)

    def measure(self, disparity, at, rounds):
        self.measured.append((int(disparity[0, 0]), rounds))
        seen = self.offset(at.offset) if callable(self.offset) else self.offset
        return lies(seen - self.hidden * (seen - at.offset)) if self.tells else None

    def run(self, monkeypatch, look=None, any_scene=False):
        self.checked = 0

        def check(*_):
            self.checked += 1

        monkeypatch.setattr(stereo, "check_same_scene", check)
        disparity, corrected, self.told, doubt = stereo._match_levelled(
            self.match, self, FirstLook(20, look), any_scene
        )
        assert disparity[0, 0] == len(self.matched)  # the map of the last match
        return round(corrected.offset, 3), doubt


def test_a_pair_that_runs_away_is_given_up_after_four_matches(monkeypatch):
    rig = Rig(lambda at: at + 1.0)
    corrected, doubt = rig.run(monkeypatch, lies(0.0))
    assert doubt == stereo.NOT_LEVELLED
    assert len(rig.matched) == 4
    assert corrected == rig.matched[-1]  # what was matched, not what would be tried next


def test_a_pair_that_a_look_led_astray_is_matched_as_it_is_too(monkeypatch):
    rig = Rig(lambda at: at + 1.0 if at else 0.0)
    assert rig.run(monkeypatch, lies(3.0)) == (0, "")
    assert rig.matched == [3, 4, 0]
