"""Which frames are one drive."""

import numpy as np
import pytest

from rollcli.errors import UsageError
from rollcli.rig.drive.assess import split_drives


def folders(*counts):
    return [f"f{number}/{place}.png" for number, count in enumerate(counts) for place in range(count)]


def as_lists(drives):
    return [(name, places.tolist()) for name, places in drives]


def test_no_frames_are_no_drives():
    assert split_drives([]) == split_drives([], "none") == split_drives([], "a*") == []


@pytest.mark.parametrize(
    ("counts", "drives"),
    [((8, 8), ["f0", "f1"]), ((7, 8), [""]), ((1, 15), ["f0", "f1"]), ((8,), ["f0"]), ((7,), [""])],
)
def test_folders_are_drives_where_they_hold_eight_frames_on_average(counts, drives):
    found = split_drives(folders(*counts))
    assert [name for name, _ in found] == drives
    assert np.array_equal(np.concatenate([places for _, places in found]), np.arange(sum(counts)))


def test_frames_of_a_drive_that_others_interrupt_stay_together_and_in_order():
    files = [f"{name}/{place}.png" for place in range(8) for name in ("b", "a")]
    assert as_lists(split_drives(files)) == [("b", [*range(0, 16, 2)]), ("a", [*range(1, 16, 2)])]


@pytest.mark.parametrize("pattern", ["data/run*", "data/run*/"])
def test_a_pattern_names_the_first_folders_of_a_path_and_leaves_the_others_as_they_are(pattern):
    files = ["data/run1/x/0.png", "data/run2/0.png", "data/run1/1.png", "other/run3/0.png", "0.png"]
    assert as_lists(split_drives(files, pattern)) == [
        ("data/run1", [0, 2]),
        ("data/run2", [1]),
        ("other/run3", [3]),
        ("", [4]),
    ]


def test_a_pattern_that_matches_no_folder_is_refused_with_one_that_is_there():
    with pytest.raises(
        UsageError, match=r"--groups run\*: matches no folder of the frames, such as data/run1$"
    ):
        split_drives(["data/run1/0.png"], "run*")


def test_all_frames_are_one_drive_where_none_are_told_apart():
    ((name, places),) = split_drives(folders(9, 9), "none")
    assert name == ""
    assert np.array_equal(places, np.arange(18))
