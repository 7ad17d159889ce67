"""How often a pair is matched until its views are level, with matches and measurements that are known."""

from dataclasses import replace

import numpy as np
import pytest

from rollcli.stereo import match as stereo
from rollcli.stereo.alignment import Measured
from rollcli.stereo.first_look import FirstLook
from rollcli.stereo.misalignment import LEVEL, Misalignment
from rollcli.stereo.misalignment_words import NOT_LEVELLED, TOO_LITTLE
from rollcli.stereo.sgbm import ALL_ROWS

SHAPE = (200, 300)
SURE = Misalignment(0.001, 1e-6, 1e-6, 1e-9)
FAR = "the views lie too far from level to be sure of the correction"


def lies(*values, error=0.0):
    return Measured(Misalignment(*values), Misalignment(error) if error else SURE, 0.5, 0.1)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(
    ("corrected", "left", "doubted"),
    [
        (Misalignment(11.9, 0.029, 0.0029), None, False),
        (Misalignment(12.1), None, True),
        (Misalignment(rotation=0.031), None, True),
        (Misalignment(scale=0.021), None, True),
        (Misalignment(scale=0.019), None, False),
        (Misalignment(scale=0.0031), lies(error=0.0101), True),
        (Misalignment(scale=0.0031), lies(error=0.0099), False),
        (Misalignment(scale=0.0029), lies(error=1.0), False),
        (LEVEL, lies(error=1.0), False),
    ],
)
def test_corrections_that_no_rig_needs_are_doubted(sign, corrected, left, doubted):
    assert stereo._doubt(corrected.times(sign), left) == (FAR if doubted else "")


def test_a_few_rows_confirm_what_leaves_little_in_them():
    def confirmed(offset, rotation=0.0, rows=slice(100, 150)):
        return stereo._is_confirmed(lies(1 + offset, rotation), Misalignment(1), SHAPE, rows)

    assert stereo._is_confirmed(None, LEVEL, SHAPE, slice(0, 9))
    assert confirmed(0.29)
    assert not confirmed(0.31)
    assert confirmed(-0.29)
    assert not confirmed(0.2, 0.0014)  # 75 px from the centre: 0.1 px more
    assert confirmed(0.2, 0.0012)
    scaled = lies(0, 0, 0.0035)
    assert not stereo._is_confirmed(scaled, LEVEL, SHAPE, slice(100, 200))
    assert stereo._is_confirmed(scaled, LEVEL, SHAPE, slice(100, 180))


def test_what_is_level_needs_no_correction():
    assert stereo._worth_correcting(None, SHAPE) == LEVEL
    assert stereo._worth_correcting(lies(0.05), SHAPE) == LEVEL
    assert stereo._worth_correcting(lies(0.4), SHAPE) == Misalignment(0.4)
    assert stereo._worth_correcting(lies(0.4, error=0.1), SHAPE) == LEVEL


def test_level_is_believed_of_the_measurement_and_of_where_two_lead_to():
    assert stereo._wanted(lies(2.1), Misalignment(2.4), SHAPE) == Misalignment(2.4)
    assert stereo._wanted(lies(2.1), Misalignment(0.01), SHAPE) == LEVEL
    assert stereo._wanted(lies(0.01), Misalignment(0.4), SHAPE) == LEVEL


@pytest.mark.parametrize(("left", "spread", "kept"), [(0.29, 0.15, True), (0.31, 0.15, False)])
def test_a_map_that_refinement_makes_right_is_kept(left, spread, kept):
    at = Misalignment(2.0)
    found = replace(lies(2 + left, error=9.0), spread=spread)
    assert stereo._is_kept(found, at, SHAPE) == kept
    assert stereo._is_kept(replace(found, spread=2 * spread), Misalignment(2 + left / 2), SHAPE) == kept


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


@pytest.mark.parametrize("any_scene", [False, True])
def test_a_level_pair_is_matched_once(monkeypatch, any_scene):
    rig = Rig(0.05)
    assert rig.run(monkeypatch, lies(0.0), any_scene=any_scene) == (0, "")
    assert rig.matched == [(0, ALL_ROWS)]
    assert rig.measured == [(1, 8)]
    assert rig.checked == (not any_scene)


def test_a_look_that_was_right_needs_one_match(monkeypatch):
    rig = Rig(3.0)
    assert rig.run(monkeypatch, lies(3.0)) == (3.0, "")
    assert rig.matched == [(3.0, ALL_ROWS)]


def test_what_a_look_missed_by_little_is_left_to_refinement(monkeypatch):
    rig = Rig(3.0)
    assert rig.run(monkeypatch, lies(2.8)) == (3.0, "")
    assert rig.matched == [(2.8, ALL_ROWS)]


def test_a_level_pair_that_the_look_took_for_uneven_is_matched_as_it_is(monkeypatch):
    rig = Rig(0.02)
    assert rig.run(monkeypatch, lies(0.2)) == (0, "")
    assert rig.matched == [(0.2, ALL_ROWS), (0, ALL_ROWS)]


def test_where_the_look_told_nothing_the_match_does(monkeypatch):
    rig = Rig(3.0)
    assert rig.run(monkeypatch) == (3.0, "")
    assert rig.matched == [(0, ALL_ROWS), (3.0, ALL_ROWS)]
    assert rig.measured == [(1, 8), (2, 8)]


def test_what_each_map_hides_is_found_in_three_matches(monkeypatch):
    rig = Rig(3.0, hidden=0.5)
    assert rig.run(monkeypatch, lies(0.0)) == (3.0, "")
    assert [at for at, _ in rig.matched] == [0, 1.5, 3.0]


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


def test_where_nothing_can_be_compared_that_is_said(monkeypatch):
    assert Rig(1.0, tells=False).run(monkeypatch) == (0, TOO_LITTLE)


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


def test_a_correction_that_is_far_is_doubted_in_few_rows_too(monkeypatch):
    assert Rig(13.0).run(monkeypatch, lies(13.0), rows=slice(90, 150)) == (13.0, FAR)
    assert Rig(13.0).run(monkeypatch, lies(13.0)) == (13.0, FAR)
