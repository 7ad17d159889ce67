"""Rows of a table and the files they are about."""

import pytest

from rollcli.errors import UsageError
from rollcli.files.matching import is_elsewhere, match_paths


@pytest.mark.parametrize(
    ("names", "rows", "expected"),
    [
        (["a.png", "b.png"], ["b.tif", "a.tif"], [1, 0]),
        (["../maps/a.png"], ["/data/maps/a.png"], [0]),
        (["maps/a.png", "maps/c.png"], ["left/a.png"], [0, None]),
        (["out/x/0.png", "out/y/0.png"], ["left/y/0.png", "left/x/0.png"], [1, 0]),
        (["a.b.png"], ["a.png", "a.b.png"], [1]),
        ([".hidden"], [".hidden"], [0]),
        ([], ["a.png"], []),
    ],
)
def test_the_same_stem_is_a_match_and_folders_decide_between_several(names, rows, expected):
    assert match_paths(names, rows, "rolls.csv") == expected


def test_rows_that_fit_equally_well_are_named():
    with pytest.raises(UsageError, match=r"rolls.csv: more than one row fits maps/0.png: a/0.png, b/0.png"):
        match_paths(["maps/0.png"], ["a/0.png", "b/0.png", "c/1.png"], "rolls.csv")


def test_one_row_for_two_files_is_refused():
    with pytest.raises(UsageError, match=r"the row of left/0.png fits a/0.png and b/0.png"):
        match_paths(["a/0.png", "b/0.png"], ["left/0.png"], "rolls.csv")


@pytest.mark.parametrize(
    ("name", "row", "of_pair", "elsewhere"),
    [
        ("b/0.png", "a/0.png", False, True),
        ("day2/maps/0.png", "day1/maps/0.png", False, True),
        ("/data/day2/maps/0.png", "/data/day1/maps/0.png", False, True),
        ("day2/maps/0.png", "day1/left/0.png", True, True),
        ("maps/0.png", "left/0.png", True, False),
        ("floats/0.tif", "maps/0.png", False, False),
        ("day2/floats/0.tif", "day1/maps/0.png", False, True),
        ("day1/maps/0.png", "day1/left/0.png", True, False),
        ("out/x/0.png", "left/x/0.png", True, False),
        ("out/maps/0.png", "day1/out/maps/0.png", False, False),
        ("0.png", "day1/maps/0.png", False, False),
        ("../maps/0.png", "maps/0.png", False, False),
        ("./maps/0.png", "maps/0.tif", False, False),
        ("/mnt/run7/maps/0.png", "/data/run7/maps/0.png", False, False),
        ("run7/maps/0.png", "/data/drives/run7/maps/0.png", False, False),
        ("s3://mine/run7/0.png", "run7/0.png", False, False),
        ("s3://mine/run8/0.png", "s3://mine/run7/0.png", False, True),
    ],
)
def test_a_row_of_another_drive_is_told_by_the_folders_that_differ(name, row, of_pair, elsewhere):
    assert is_elsewhere(name, row, of_pair=of_pair) is elsewhere
