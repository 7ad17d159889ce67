"""Without --overwrite, no run touches an image that another run or program wrote, however late it came."""

import json

import pytest

from tests.run_cli import contents, keep_rows, road_map, rollcli, write_kitti

FRAMES = 4


def estimate(folder, *arguments, images="up"):
    return rollcli("estimate", "maps", "-o", "rolls.csv", "--derotated", images, *arguments, cwd=folder)


def stop_after_two_frames(folder, *arguments):
    """A run that ends at a broken frame, whose map is whole again afterwards but has an `error` row."""
    (folder / "maps" / "frame1.png").write_bytes(b"no map")
    assert estimate(folder, "--fail-fast", *arguments).status == 3
    assert (folder / "rolls.csv").read_bytes().count(b"\n") == 3


def test_a_resume_without_a_result_starts_only_where_no_image_is(maps):
    assert estimate(maps).status == 0
    (maps / "rolls.csv").rename(maps / "first.csv")
    (maps / "rolls.csv.run.json").rename(maps / "first.csv.run.json")
    before = contents(maps)
    done = estimate(maps, "--resume")
    assert done.status == 2
    assert "up/frame0.png: exists already; give --overwrite to replace it" in done.err
    assert {name: data for name, data in contents(maps).items() if name != "rolls.csv"} == before


def test_a_resume_in_the_folder_of_another_result_starts_only_where_no_image_is(maps):
    assert rollcli("estimate", "maps", "-o", "first.csv", "--derotated", "other", cwd=maps).status == 0
    stop_after_two_frames(maps)
    keep_rows(maps / "rolls.csv", 0)  # killed before its first row
    before = contents(maps / "other")
    done = estimate(maps, "--resume", images="other")
    assert done.status == 2
    assert "other/frame0.png: exists already" in done.err
    assert contents(maps / "other") == before


def test_a_run_that_was_killed_before_its_first_row_goes_on(maps):
    assert estimate(maps).status == 0
    before = contents(maps)
    keep_rows(maps / "rolls.csv", 0)
    assert estimate(maps, "--resume").status == 0
    assert contents(maps) == before


def test_an_image_that_came_while_a_run_was_interrupted_ends_its_resume(maps):
    stop_after_two_frames(maps)
    foreign = maps / "up" / "frame3.png"
    foreign.write_bytes(b"precious")
    done = estimate(maps, "--resume")
    assert done.status == 1
    assert done.err.splitlines()[-1] == (
        "rollcli: up/frame3.png: exists already and is not of this run; move it away, or give --overwrite to "
        "replace it; 3 rows are kept, continue with --resume"
    )
    assert foreign.read_bytes() == b"precious"
    foreign.unlink()
    assert estimate(maps, "--resume").status == 3
    assert sorted(contents(maps / "up")) == ["frame0.png", "frame2.png", "frame3.png"]


def test_a_frame_that_fails_after_a_resume_leaves_the_images_of_others(maps):
    (maps / "maps" / "frame3.png").write_bytes(b"no map")
    stop_after_two_frames(maps)
    (maps / "up" / "frame3.png").write_bytes(b"precious")
    assert estimate(maps, "--resume").status == 3
    assert (maps / "up" / "frame3.png").read_bytes() == b"precious"


def test_a_run_that_was_told_to_overwrite_does_so_after_a_resume(maps):
    write_kitti(maps / "up" / "frame3.png", road_map(0.2))
    stop_after_two_frames(maps, "--overwrite")
    assert json.loads((maps / "rolls.csv.run.json").read_text())["replaces_images"] is True
    assert estimate(maps, "--resume").status == 3
    resumed = contents(maps)
    assert "replaces_images" not in json.loads(resumed["rolls.csv.run.json"])
    assert estimate(maps, "--overwrite").status == 3
    assert contents(maps) == resumed


@pytest.mark.parametrize("text", ["1", '"yes"', "[]", "null", "false"])
def test_nothing_but_true_in_the_record_allows_to_overwrite(maps, text):
    stop_after_two_frames(maps)
    record = maps / "rolls.csv.run.json"
    record.write_text(
        record.read_text().replace('"counts": {}', f'"counts": {{}}, "replaces_images": {text}')
    )
    (maps / "up" / "frame3.png").write_bytes(b"precious")
    assert estimate(maps, "--resume").status == 1
    assert (maps / "up" / "frame3.png").read_bytes() == b"precious"


def test_a_resume_in_parts_starts_only_where_no_image_is(maps):
    pytest.importorskip("pyarrow")
    arguments = ("estimate", "maps", "--derotated", "up", "--resume", "-o")
    assert rollcli(*arguments, "first.parquet", cwd=maps).status == 0
    before = contents(maps)
    assert "up/frame0.png: exists already" in rollcli(*arguments, "second.parquet", cwd=maps).refused()
    assert contents(maps) == before
    assert rollcli(*arguments, "first.parquet", cwd=maps).status == 0
    assert contents(maps) == before
