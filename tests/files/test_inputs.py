"""Inputs are found once each, in natural order, and paired or named."""

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rollcli.errors import UsageError
from rollcli.files.inputs import find_inputs, pair_inputs


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder, and a function that fills it."""
    monkeypatch.chdir(tmp_path)

    def fill(*names):
        for name in names:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"x")
        return tmp_path

    return fill


def names(found):
    return [each.name for each in found]


def test_a_folder_gives_its_readable_files_in_natural_order(here):
    here(
        "maps/f10.png", "maps/f2.npy", "maps/f1.TIF", "maps/.hidden.png", "maps/notes.txt", "maps/sub/f0.png"
    )

    found = find_inputs(["maps"])

    assert names(found) == ["maps/f1.TIF", "maps/f2.npy", "maps/f10.png"]
    assert [each.relative for each in found] == ["f1.TIF", "f2.npy", "f10.png"]


def test_recursion_keeps_relative_folders_and_leaves_hidden_ones(here):
    here("maps/a/f1.png", "maps/b/c/f1.png", "maps/.git/f.png", "maps/f1.png")

    found = find_inputs(["maps"], recursive=True)

    assert [each.relative for each in found] == ["a/f1.png", "b/c/f1.png", "f1.png"]


def test_a_file_named_outright_is_taken_whatever_its_ending(here):
    here("map.dat", ".hidden.png")

    assert names(find_inputs(["map.dat", ".hidden.png"])) == [".hidden.png", "map.dat"]


def test_each_file_comes_once_however_it_is_spelt(here):
    root = here("maps/f1.png", "maps/f2.png")
    (root / "link").symlink_to("maps")

    spellings = [
        "maps/f1.png",
        "./maps/f1.png",
        "maps/../maps/f1.png",
        str(root / "maps" / "f1.png"),
        "link/f1.png",
    ]

    assert names(find_inputs([*spellings, "maps", "maps/*.png"])) == ["maps/f1.png", "maps/f2.png"]


def test_links_to_one_file_are_frames_of_their_own(here):
    root = here("maps/f1.png")
    (root / "maps" / "f2.png").symlink_to("f1.png")

    assert names(find_inputs(["maps"])) == ["maps/f1.png", "maps/f2.png"]


def test_patterns_are_expanded_below_their_fixed_folder(here):
    here("runs/a/disp/f1.png", "runs/b/disp/f1.png", "runs/b/disp/f1.txt", "runs/b/left/f1.png")

    found = find_inputs(["runs/*/disp/*"])
    assert [each.relative for each in found] == ["a/disp/f1.png", "b/disp/f1.png"]

    assert names(find_inputs(["runs/**/*.png"])) == [
        "runs/a/disp/f1.png",
        "runs/b/disp/f1.png",
        "runs/b/left/f1.png",
    ]


def test_a_file_whose_name_looks_like_a_pattern_is_that_file(here):
    here("map[1].png", "map1.png")

    assert names(find_inputs(["map[1].png"])) == ["map[1].png"]


def test_lists_come_from_stdin_and_from_files(here):
    root = here("a b.png", "f[1].png", "maps/f1.png")
    (root / "list.txt").write_bytes(b"f[1].png\r\n\r\nmaps\n")

    assert names(find_inputs(["-"], stdin=["a b.png\n", "\n"])) == ["a b.png"]
    assert names(find_inputs([], files_from="-", stdin=["a b.png"])) == ["a b.png"]
    assert names(find_inputs([], files_from="list.txt")) == ["f[1].png", "maps/f1.png"]


def test_stdin_is_read_when_no_lines_are_given(here, monkeypatch):
    here("ä.png")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO("ä.png\n".encode())))

    assert names(find_inputs(["-"])) == ["ä.png"]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no names that are no text")
def test_names_that_are_no_text_are_found(here):
    root = here("a.png")
    name = os.fsdecode(b"\xff.png")
    (root / name).write_bytes(b"x")
    (root / "list.txt").write_bytes(b"\xff.png\n")

    assert names(find_inputs([], files_from="list.txt")) == [name]
    assert name in names(find_inputs(["."]))


def test_include_and_exclude_look_at_names_and_relative_paths(here):
    here("maps/left/f1.png", "maps/left/f2.png", "maps/right/f1.png")

    def relatives(**choice):
        return [each.relative for each in find_inputs(["maps"], recursive=True, **choice)]

    assert relatives(include=["f1*"]) == ["left/f1.png", "right/f1.png"]
    assert relatives(include=["left/*"], exclude=["*2.png"]) == ["left/f1.png"]
    assert relatives(exclude=["right/*", "f2.png"]) == ["left/f1.png"]
    with pytest.raises(UsageError, match="maps: no input found in this folder"):
        relatives(include=["none*"])


def test_results_never_become_inputs(here):
    here("maps/f1.png", "maps/out/f1.png", "maps/out/deep/f1.png")

    assert names(find_inputs(["maps"], recursive=True, skip=["maps/out"])) == ["maps/f1.png"]
    assert names(find_inputs(["maps/**/*.png"], skip=["./maps/out"])) == ["maps/f1.png"]
    assert names(find_inputs(["maps/*.png"], skip=["."])) == ["maps/f1.png"]
    with pytest.raises(UsageError, match="maps: is an input and an output folder"):
        find_inputs(["maps"], skip=["maps/"])


def test_links_in_a_circle_end(here):
    root = here("maps/f1.png")
    (root / "maps" / "self").symlink_to(root / "maps")

    assert names(find_inputs(["maps"], recursive=True)) == ["maps/f1.png"]


def test_a_link_to_nothing_is_an_input_that_its_row_will_explain(here):
    root = here("maps/f1.png")
    (root / "maps" / "f2.png").symlink_to("gone.png")

    assert names(find_inputs(["maps"])) == ["maps/f1.png", "maps/f2.png"]
    assert names(find_inputs(["maps/f2.png"])) == ["maps/f2.png"]


def test_a_missing_file_among_others_is_an_input_and_alone_it_is_an_error(here):
    here("f1.png")

    assert names(find_inputs(["f1.png", "f2.png"])) == ["f1.png", "f2.png"]
    with pytest.raises(UsageError, match=r"no input found: f2.png, f3.png: no such file"):
        find_inputs(["f2.png", "f3.png"])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_pipes_and_folders_with_readable_endings_are_no_files(here):
    root = here("maps/f1.png", "maps/folder.png/f2.png")
    os.mkfifo(root / "maps" / "pipe.png")

    assert names(find_inputs(["maps"])) == ["maps/f1.png"]


@pytest.mark.parametrize(
    ("inputs", "reason"),
    [
        (["empty"], r"empty: no input found in this folder \(.*\)$"),
        (["empty/*.png"], r"empty/\*.png: no input found in this pattern"),
        (["f1.png", "none/**"], r"none/\*\*: no input found in this pattern"),
        (["-"], "no input found: the list is empty"),
        ([], "no input found: the list is empty"),
    ],
)
def test_what_gives_nothing_is_named(here, inputs, reason):
    (here("f1.png") / "empty").mkdir()

    with pytest.raises(UsageError, match=reason):
        find_inputs(inputs, stdin=[])


def test_an_empty_name_is_not_the_working_folder(here):
    here("f1.png")

    with pytest.raises(UsageError, match="empty name"):
        find_inputs([""])


def test_a_closed_stdin_is_named(here, monkeypatch):
    here("f1.png")
    monkeypatch.setattr(sys, "stdin", None)

    with pytest.raises(UsageError, match="stdin is closed"):
        find_inputs(["-"])


def test_a_list_that_cannot_be_read_is_named(here):
    here("maps/f1.png")

    with pytest.raises(UsageError, match=r"none.txt: the list of files cannot be read: no such file"):
        find_inputs([], files_from="none.txt")
    with pytest.raises(UsageError, match="maps: the list of files cannot be read: is a directory"):
        find_inputs([], files_from="maps")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_folder_without_permission_is_named(here):
    root = here("maps/f1.png")
    (root / "maps").chmod(0)

    with pytest.raises(UsageError, match="maps: this folder cannot be read: permission denied"):
        find_inputs(["maps"])


# -- pairs


def pairs(found):
    return [(each.left.name, each.right.name) for each in found]


def test_folders_are_paired_by_equal_names(here):
    here("l/f10.png", "l/f2.png", "r/f2.jpg", "r/f10.png")

    assert pairs(pair_inputs("l", "r")) == [("l/f2.png", "r/f2.jpg"), ("l/f10.png", "r/f10.png")]


def test_two_files_are_a_pair_whatever_they_are_called(here):
    here("a.png", "b.png")

    assert pairs(pair_inputs("a.png", "b.png")) == [("a.png", "b.png")]


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("left", "right"),
        ("scene_left", "scene_right"),
        ("left_000", "right_000"),
        ("sceneLeft", "sceneRight"),
        ("aachen_000_leftImg8bit", "aachen_000_rightImg8bit"),
        ("000_l", "000_r"),
        ("000L", "000R"),
        ("m1_L1", "m1_R1"),
        ("im0", "im1"),
        ("img_0", "img_1"),
        ("im2", "im6"),
        ("image_02", "image_03"),
        ("image_2", "image_3"),
        ("cam0", "cam1"),
        ("cam1", "cam2"),
        ("000123_0", "000123_1"),
        ("view1", "view5"),
    ],
)
def test_marks_of_the_sides_are_known_in_names_and_in_folders(here, left, right):
    here(f"one/{left}.png", f"one/{right}.png", f"two/x/{left}/9.png", f"two/x/{right}/9.png")
    here(f"three/{left}.png", f"four/{right}.png", f"three/b_{left}.png", f"four/b_{right}.png")

    assert pairs(pair_inputs("one", "one")) == [(f"one/{left}.png", f"one/{right}.png")]
    assert pairs(pair_inputs("two", "two", recursive=True)) == [
        (f"two/x/{left}/9.png", f"two/x/{right}/9.png")
    ]
    assert set(pairs(pair_inputs("three", "four"))) == {
        (f"three/b_{left}.png", f"four/b_{right}.png"),
        (f"three/{left}.png", f"four/{right}.png"),
    }


def test_patterns_are_paired_over_mirrored_folders(here):
    here("run/a/image_2/0.png", "run/a/image_3/0.png", "run/b/image_2/0.png", "run/b/image_3/0.png")

    assert pairs(pair_inputs("run/*/image_2/*.png", "run/*/image_3/*.png")) == [
        ("run/a/image_2/0.png", "run/a/image_3/0.png"),
        ("run/b/image_2/0.png", "run/b/image_3/0.png"),
    ]


def test_numbered_frames_in_marked_folders_are_not_taken_for_sides(here):
    here(*[f"run/{side}/frame_{number}.png" for side in ("left", "right") for number in range(6)])

    found = pairs(pair_inputs("run", "run", recursive=True))

    assert found == [(f"run/left/frame_{n}.png", f"run/right/frame_{n}.png") for n in range(6)]


@pytest.mark.parametrize(
    ("files", "sides", "reason"),
    [
        ("l/a l/0 l/1 l/2 l/3 r/a", "l r", "no partner found for l/0.png, l/1.png, l/2.png and 1 more"),
        ("one/a one/b", "one one/../one", "the same images.*: one/a.png, one/b.png; name the images of the"),
        ("one/a two/a", "one/a.png two/../one", "one/a.png: is given by --left and by --right"),
        ("l/a", "l r", "no input found: r: no such file"),
    ],
)
def test_what_cannot_be_paired_is_named_and_counted(here, files, sides, reason):
    here(*(f"{name}.png" for name in files.split()))
    with pytest.raises(UsageError, match=reason):
        pair_inputs(*sides.split())


def test_more_than_one_partner_is_an_error_that_names_them(here):
    here("l/a.png", "l/a.jpg", "r/a.png")
    with pytest.raises(UsageError, match=r"l/a.jpg, l/a.png, r/a.png: more than one partner"):
        pair_inputs("l", "r")


def test_names_that_pair_by_order_alone_are_told_so(here):
    here("l/0001.png", "l/0003.png", "r/0002.png", "r/0004.png")

    with pytest.raises(UsageError, match=r"and 1 more; --match order pairs the first with the first"):
        pair_inputs("l", "r")
    assert pairs(pair_inputs("l", "r", match="order"))[1] == ("l/0003.png", "r/0004.png")
    with pytest.raises(UsageError, match=r"l/0001.png: is given by --left and by --right"):
        pair_inputs("l", "l/../l", match="order")


def test_pairs_by_order_need_as_many_of_each(here):
    here("l/a1.png", "l/a10.png", "l/a2.png", "r/b3.png", "r/b30.png", "r/b4.png")

    assert pairs(pair_inputs("l", "r", match="order")) == [
        ("l/a1.png", "r/b3.png"),
        ("l/a2.png", "r/b4.png"),
        ("l/a10.png", "r/b30.png"),
    ]
    here("l/a3.png")
    with pytest.raises(UsageError, match="4 left and 3 right images"):
        pair_inputs("l", "r", match="order")


def test_a_list_may_be_separated_as_find_print0_does(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a\nb.png", "c.png"):
        Path(name).touch()
    Path("list").write_bytes(b"a\nb.png\0c.png\0")
    assert [each.name for each in find_inputs((), files_from="list")] == ["a\nb.png", "c.png"]


@pytest.fixture
def deep(here):
    """A folder in a folder, a thousand times, with a map in the last."""
    root = here("deep/map.png")
    folder = os.open(root / "deep", os.O_RDONLY)
    for _ in range(1000):
        os.mkdir("d", dir_fd=folder)
        inner = os.open("d", os.O_RDONLY, dir_fd=folder)
        os.close(folder)
        folder = inner
    os.close(os.open("map.png", os.O_CREAT, dir_fd=folder))
    os.close(folder)
    yield "deep"
    subprocess.run(["rm", "-rf", root / "deep"], check=True)  # shutil fails at this depth


@pytest.mark.skipif(os.name == "nt", reason="folders are made from open folders")
def test_a_thousand_nested_folders_are_searched(deep):
    found = find_inputs([deep], recursive=True)

    assert [each.relative for each in found] == ["d/" * 1000 + "map.png", "map.png"]
    with pytest.raises(UsageError, match="too deep for a pattern; name the folder, with --recursive"):
        find_inputs([f"{deep}/**/*.png"])


def test_a_file_that_the_system_refuses_to_look_at_is_an_input_that_its_row_will_explain(here, monkeypatch):
    here("maps/a.png", "maps/b.png")
    stat = os.stat

    def refuse(path, **options):
        if str(path).endswith("a.png"):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", refuse)

    assert names(find_inputs(["maps"])) == ["maps/a.png", "maps/b.png"]


def test_a_folder_without_inputs_says_what_it_holds_instead(here):
    here("photos/1.jpg", "photos/2.JPG", "nested/inner/1.png")

    with pytest.raises(UsageError, match=r"photos: no input found .*\); it holds \.jpg files$"):
        find_inputs(["photos"])
    with pytest.raises(UsageError, match=r"nested: no input found .*\); --recursive searches its folders$"):
        find_inputs(["nested"])
