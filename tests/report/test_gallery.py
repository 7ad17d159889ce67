"""Which frames are shown in pictures."""

import pytest

from rollcli.report.sources import JUMP, SPREAD, SUSPECT, WIDEST, choose
from tests.report.results import row


def places(choices, reason):
    return [each.place for each in choices if each.reason == reason]


def test_the_widest_then_suspect_ones_then_evenly_spread_ones():
    rows = [row(f"{i}.png", width=0.05) for i in range(300)]
    for place in (17, 100, 250):
        rows[place] = row(f"{place}.png", width=1 + place / 1000)
    for place in range(30, 60):
        rows[place] = row(f"{place}.png", width=0.3, status="suspect")
    chosen = choose(rows, 9)
    assert places(chosen, WIDEST) == [250, 100, 17]
    assert places(chosen, SUSPECT) == [35, 45, 55]
    rest = places(chosen, SPREAD)
    assert len(rest) == 3
    assert rest[0] < 80 < rest[1] < 180 < rest[2]


def test_the_frames_around_a_jump_come_first():
    rows = [row(f"{i}.png", None if i in (49, 51) else 1.0) for i in range(100)]
    chosen = choose(rows, 12, [10, 50])
    assert places(chosen, JUMP) == [9, 10, 48, 50]
    assert len(chosen) == len({each.place for each in chosen}) == 12
    assert places(choose(rows, 12, [0, 99]), JUMP) == [0, 98, 99]  # a drive may begin with one
    assert places(choose(rows, 4, range(10, 90, 10)), JUMP) == [79, 80]  # others find room, too
    assert places(choose(rows, 3, [50]), JUMP) == []


def test_frames_without_an_angle_are_never_chosen():
    rows = [row(f"{i}.png", None if i % 2 else 1.0) for i in range(20)]
    assert sorted(each.place for each in choose(rows, 12)) == list(range(0, 20, 2))


@pytest.mark.parametrize("count", [0, 1, 2, 5, 12, 100])
def test_as_many_as_asked_for_and_none_twice(count):
    rows = [
        row(f"{i}.png", width=None if i < 5 else 0.1, status="suspect" if i < 3 else "ok") for i in range(20)
    ]
    chosen = [each.place for each in choose(rows, count)]
    assert len(chosen) == len(set(chosen)) == min(count, 20)
