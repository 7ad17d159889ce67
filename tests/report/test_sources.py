"""Where the files of a row are looked for, and which frames are shown in pictures."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from rollcli.errors import UsageError
from rollcli.report import sources
from rollcli.report.sources import JUMP, SPREAD, SUSPECT, WIDEST, choose, subjects
from rollcli.run.options import ImageOptions
from tests.report.results import row, write_result
from tests.run_cli import rollcli, write_maps
from tests.web_server import file_below, web_server

NONE = ImageOptions()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def touch(*names):
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()


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


@pytest.fixture
def server(tmp_path):
    """A server over the folder `served`: its address, what it was asked for, and the folder."""
    write_maps(tmp_path / "served", 1)
    with web_server(partial(file_below, tmp_path / "served")) as (address, asked):
        yield SimpleNamespace(address=address, asked=asked, folder=tmp_path / "served")


def report(folder, result, server, *arguments):
    keys = {"AWS_ENDPOINT_URL": server.address, "AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b"}
    return rollcli("report", result, "-o", "page.html", *arguments, cwd=folder, **keys)


@pytest.mark.parametrize(
    "name", ["{}/frame0.png", "s3://private/frame0.png", "HTTP{}/frame0.png", "az://private/frame0.png"]
)
def test_a_remote_row_of_a_local_result_is_asked_for_by_nobody(tmp_path, server, name):
    name = name.format(server.address if name.startswith("{") else server.address.removeprefix("http"))
    write_result(tmp_path / "rolls.csv", [row(name)])

    done = report(tmp_path, "rolls.csv", server)

    assert server.asked == []
    assert done.status == 3
    assert "is remote, and the result does not lie there; --fetch follows it" in done.err


def test_both_images_of_a_pair_must_lie_with_the_result(tmp_path, server):
    pair = replace(row("frame0.png"), right_file=f"{server.address}/frame0.png")
    write_result(tmp_path / "rolls.csv", [pair])
    assert report(tmp_path, "rolls.csv", server).status == 3
    assert server.asked == []


def test_pictures_from_images_ask_for_nothing(tmp_path, server):
    write_result(tmp_path / "rolls.csv", [row(f"{server.address}/frame0.png")])
    write_maps(tmp_path / "out" / "derotated", 1)
    report(tmp_path, "rolls.csv", server, "--images", "out")
    assert server.asked == []


def test_fetch_follows_a_remote_row(tmp_path, server):
    write_result(tmp_path / "rolls.csv", [row(f"{server.address}/frame0.png")])
    assert report(tmp_path, "rolls.csv", server, "--fetch").status == 0
    assert "/frame0.png" in server.asked


def test_rows_of_a_result_in_the_same_store_are_followed_and_no_others(tmp_path, server):
    other = server.address.replace("127.0.0.1", "localhost")
    rows = [row(f"{server.address}/frame0.png"), row(f"{other}/other.png")]
    write_result(server.folder / "rolls.csv", rows)

    done = report(tmp_path, f"{server.address}/rolls.csv", server)

    assert done.status == 3
    assert set(server.asked) == {"/rolls.csv", "/frame0.png"}
