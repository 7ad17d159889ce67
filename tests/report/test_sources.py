"""Where the files of a row are looked for."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from rollcli.errors import UsageError
from rollcli.report import sources
from rollcli.report.sources import subjects
from rollcli.run.options import ImageOptions
from tests.report.results import row

NONE = ImageOptions()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def touch(*names):
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()


@pytest.mark.parametrize(
    ("file", "tails"),
    [
        ("a/b/c.png", ["a/b/c", "b/c", "c"]),
        ("/a/b.v2.npy", ["a/b.v2", "b.v2"]),
        ("../a/b.png", ["a/b", "b"]),
        ("a/../b.png", ["b"]),
        ("/", []),
        (".", []),
    ],
)
def test_an_image_is_looked_for_by_the_end_of_its_frames_path(file, tails):
    assert list(sources._tails(file)) == tails


def test_images_are_found_by_kind_in_their_folders_and_by_the_ending_of_a_map(folder):
    touch("out/derotated/a.tif", "out/vdisparity/a.tif", "out/road_mask/a.npy", "out/disparity/run/a.npy")
    (found,) = subjects([row("run/a.png")], "rolls.csv", "out/", NONE)
    assert found.images == {"derotated": "out/derotated/a.tif", "disparity": "out/disparity/run/a.npy"}
    touch("out/vdisparity/a.png", "out/road_mask/a.png", "out/heights/a.npy", "out/heights_preview/a.png")
    (found,) = subjects([row("run/a.png")], "rolls.csv", "out", NONE)
    assert found.images.keys() == {kind.name for kind in sources.KINDS}
    assert found.images_only


def test_images_are_found_under_the_name_that_the_run_gave_their_folder(folder):
    touch("out/up/a.png", "out/..a/a.png")
    recorded = NONE._replace(derotated="elsewhere/up/")
    (found,) = subjects([row("a.png")], "rolls.csv", "out", recorded)
    assert found.images == {"derotated": "out/up/a.png"}
    with pytest.raises(UsageError, match=r"out: has no image of a\.png"):
        subjects([row("a.png")], "rolls.csv", "out", NONE)


def assert_found(result, images, recorded, image):
    """The image is that of the frame, or none is found where it is None."""
    options = NONE if recorded is None else NONE._replace(derotated=recorded)
    if image is not None:
        (found,) = subjects([row("a.png")], result, images, options)
        assert found.images == {"derotated": image}
    else:
        with pytest.raises(UsageError, match="has no image of"):
            subjects([row("a.png")], result, images, options)


@pytest.mark.parametrize(
    ("images", "recorded", "there"),
    [
        ("derotated", None, True),  # by its own name
        ("up", "up", True),  # the run wrote them there
        ("up", None, False),
        ("up", "x/..", False),
    ],
)
def test_the_folder_of_one_kind_may_be_named_itself(folder, images, recorded, there):
    touch(f"{images}/a.png")
    assert_found("rolls.csv", images, recorded, f"{images}/a.png" if there else None)


@pytest.mark.parametrize(
    ("images", "recorded", "there"),
    [
        ("s3://maps/up/", "s3://maps/up", True),
        ("s3://maps/up", "s3://maps/up/", True),
        ("s3://maps/derotated", None, True),
        ("s3://maps/up", None, False),
        ("s3://maps/up", "s3://maps/other", False),
    ],
)
def test_the_same_holds_in_an_object_store(monkeypatch, images, recorded, there):
    place = images.rstrip("/")
    monkeypatch.setattr(
        sources, "objects_behind", lambda url, recursive: [(f"{place}/a.png", 9)] if recursive else []
    )
    assert_found("s3://maps/rolls.csv", images, recorded, f"{place}/a.png" if there else None)


def test_a_folder_is_known_by_its_real_name(folder, monkeypatch):
    touch("derotated/a.png")
    monkeypatch.chdir(folder / "derotated")
    (found,) = subjects([row("a.png")], "rolls.csv", ".", NONE)
    assert found.images == {"derotated": "./a.png"}


def test_a_folder_that_is_not_there_or_empty_is_refused(folder, monkeypatch):
    with pytest.raises(UsageError, match="out: no such folder of images"):
        subjects([row("a.png")], "rolls.csv", "out", NONE)
    monkeypatch.setattr(sources, "objects_behind", lambda url, recursive: [])
    with pytest.raises(UsageError, match="s3://maps/out: no such folder of images"):
        subjects([row("a.png")], "rolls.csv", "s3://maps/out", NONE)


def test_inputs_are_here_or_beside_the_result(folder):
    touch("here.png", "results/here.png", "results/beside.png")
    pair = replace(row("here.png"), right_file="beside.png")
    both, none = subjects([pair, row("nowhere.png")], "results/rolls.csv", None, NONE)
    assert (both.frame.path, both.frame.right_path) == ("here.png", str(Path("results", "beside.png")))
    assert (none.frame.path, none.frame.right_path) == ("nowhere.png", "")
    assert (none.images, none.images_only) == ({}, False)


def test_a_subject_has_the_angle_and_the_whole_parabola_of_its_row(folder):
    whole, part, nothing = subjects(
        [row("a.png", 3.0), replace(row("b.png", -2.0), alpha2=None), row("c.png", None)],
        "rolls.csv",
        None,
        NONE,
    )
    assert (whole.theta, whole.alpha) == (math.radians(3), (20.0, 0.3, 0.0))
    assert (part.theta, part.alpha) == (math.radians(-2), None)
    assert nothing.theta == 0
