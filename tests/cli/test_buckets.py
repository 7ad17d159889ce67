"""Buckets in and out: what works on a disk works in an object store."""

import pytest

from rollcli.files.storage import remove
from tests.object_store import joined, objects_below, upload
from tests.run_cli import contents, estimated, rollcli, write_maps
from tests.store_proxy import Faults, proxied


@pytest.fixture
def bucket(bucket, tmp_path):
    """Five maps on disk and in the bucket."""
    write_maps(tmp_path / "maps", 5)
    upload(tmp_path / "maps", f"{bucket}/maps")
    return bucket


@pytest.mark.parametrize("place", ["bucket", "disk"])
def test_a_folder_of_parts_may_be_named_with_a_slash(bucket, tmp_path, place):
    result = f"{bucket if place == 'bucket' else tmp_path}/rolls.parquet"
    line = ("estimate", f"{bucket}/maps", "--resume", "-o")
    rollcli(*line, f"{result}/", cwd=tmp_path, status=0)
    assert "5 frames (5 kept)" in rollcli(*line, result, cwd=tmp_path).err
    assert "(5 of 5 frames)" in rollcli("rig", f"{result}/", cwd=tmp_path).out
    assert sorted(objects_below(result)) == ["part-00000.parquet"]


@pytest.mark.parametrize("place", ["bucket", "disk"])
def test_images_of_kept_rows_that_are_missing_are_made_again(bucket, tmp_path, place):
    level = f"{bucket}/level" if place == "bucket" else str(tmp_path / "level")
    line = ("estimate", f"{bucket}/maps", "-o", f"{bucket}/rolls.csv", "--derotated", level)
    line = (*line, "--part-rows", "2")
    assert rollcli(*line, cwd=tmp_path).status == 0
    rows, images = joined(f"{bucket}/rolls.csv"), objects_below(level)
    for name in ("frame1.png", "frame4.png"):
        remove(f"{level}/{name}")
    listed = rollcli(*line, "--resume", "--dry-run", cwd=tmp_path).out
    assert [each for each in listed.splitlines() if each.startswith("read")] == [
        f"read  {bucket}/maps/frame{index}.png" for index in (1, 4)
    ]
    done = rollcli(*line, "--resume", cwd=tmp_path)
    told = "images are missing or empty for 2 of the kept rows" in done.err
    assert (done.status, told) == (0, True), done.err
    assert joined(f"{bucket}/rolls.csv") == rows
    assert objects_below(level) == images


@pytest.mark.parametrize("form", ["csv", "parquet", "jsonl"])
def test_a_shard_without_frames_is_a_result_without_rows(bucket, tmp_path, form):
    place = str(tmp_path) if form == "jsonl" else bucket  # a file of no bytes
    results = [f"{place}/{shard}.{form}" for shard in range(1, 7)]
    for shard, result in enumerate(results, 1):
        line = ("estimate", f"{bucket}/maps", "-o", result, "--shard", f"{shard}/6", "-q")
        assert rollcli(*line, cwd=tmp_path).status == 0
    assert f"6.{form}: has no rows" in rollcli("rig", results[-1], cwd=tmp_path).refused()
    assert "(5 of 5 frames)" in rollcli("rig", *results, cwd=tmp_path).out


def test_the_case_of_a_scheme_does_not_matter(bucket, tmp_path):
    upper = bucket.replace("s3://", "S3://")
    done = rollcli("estimate", f"{upper}/maps", cwd=tmp_path)
    assert (done.status, done.out.count(f"{upper}/maps/frame")) == (0, 5), done.err


def test_outputs_are_not_searched_but_what_lies_beside_them_is(bucket, tmp_path):
    line = ("derotate", "--roll", "1", "--recursive", "--dry-run", "-o")
    both = rollcli(*line, f"{bucket}/maps", f"{bucket}/maps", cwd=tmp_path).refused()
    assert f"{bucket}/maps: is an input and an output folder; write the results elsewhere" in both
    assert rollcli(*line, bucket, f"{bucket}/maps", cwd=tmp_path).out.count("read ") == 5
    assert "no input found" in rollcli(*line, f"{bucket}/maps", bucket, cwd=tmp_path).refused()


def test_a_prefix_with_a_dot_is_a_folder_where_objects_lie_below_it(tmp_path, bucket, store):
    write_maps(tmp_path / "maps", 2)
    upload(tmp_path / "maps", f"{bucket}/2024.05.01")
    folder = rollcli("estimate", f"{bucket}/2024.05.01", cwd=tmp_path, **store, status=0)
    file = rollcli("estimate", f"{bucket}/2024.05.02", cwd=tmp_path, **store)
    assert f"{bucket}/2024.05.01/frame1.png" in folder.out
    assert "there is no such object" in file.out + file.err


MAPS = 80


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Maps on disk, with their rows and de-rotated images."""
    folder = tmp_path_factory.mktemp("local")
    return estimated(folder, MAPS, "--derotated", "level", width=80, height=60)


@pytest.mark.slow
def test_requests_that_fail_change_no_byte_of_a_result(store, bucket, local):
    upload(local / "maps", f"{bucket}/maps")
    faults = Faults(0.05, seed=1)
    line = ("estimate", f"{bucket}/maps", "-o", f"{bucket}/rolls.csv", "--derotated", f"{bucket}/level")
    with proxied(store["AWS_ENDPOINT_URL"], faults) as address:
        variables = {**store, "AWS_ENDPOINT_URL": address, "ROLLCLI_STORE_TIMEOUT": "1"}
        rollcli(*line, "--part-rows", "20", "-j", "2", cwd=local, **variables, status=0)
    assert min(faults.counts[kind] for kind in ("500", "503", "cut", "never")) > 0, faults.counts
    rows = (local / "rolls.csv").read_bytes().replace(b"maps/", f"{bucket}/maps/".encode())
    assert joined(f"{bucket}/rolls.csv") == rows
    assert objects_below(f"{bucket}/level") == contents(local / "level")
