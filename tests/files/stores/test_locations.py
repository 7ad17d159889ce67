"""Names of places: which are URLs, and what their parts are; names of parts, and their order."""

import pytest

from rollcli.errors import UsageError
from rollcli.files.results import part_names
from rollcli.files.search import _fits
from rollcli.files.stores.locations import (
    base_name,
    is_object_url,
    is_url,
    is_web_url,
    scheme_of,
    split_url,
)


@pytest.mark.parametrize(
    ("location", "is_one"),
    [
        ("s3://bucket/a.png", True),
        ("S3://bucket/a.png", True),
        ("ab+c.d-1://x", True),
        ("c://maps/a.png", False),
        ("maps/s3://x", False),
        ("1s3://x", False),
        ("s3:/bucket", False),
        ("maps", False),
    ],
)
def test_a_url_has_a_scheme_of_two_letters_or_more(location, is_one):
    assert is_url(location) == is_one


def test_stores_and_web_servers_are_told_apart_whatever_their_case():
    for scheme in ("s3", "gs", "az", "S3"):
        assert scheme_of(f"{scheme}://b/k") == scheme.lower()
        assert is_object_url(f"{scheme}://b/k")
        assert not is_web_url(f"{scheme}://b/k")
    for scheme in ("http", "https", "HTTPS"):
        assert is_web_url(f"{scheme}://b/k")
        assert not is_object_url(f"{scheme}://b/k")
    assert not is_object_url("maps")
    assert not is_web_url("maps")


def test_a_bucket_and_its_key_are_split_and_keys_of_access_are_refused():
    assert split_url("s3://bucket") == ("s3://bucket", "")
    assert split_url("S3://bucket/a/b?c.png") == ("s3://bucket", "a/b?c.png")
    with pytest.raises(UsageError, match=r"^s3://bucket/x: keys go into the environment, not into a URL"):
        split_url("s3://key:secret@bucket/x")
    with pytest.raises(UsageError, match=r"^gs:///x: names no bucket; write gs://bucket/prefix"):
        split_url("gs:///x")


def test_the_last_part_of_a_web_address_is_that_of_its_path():
    assert base_name("https://host/maps/a%20b.png?sig=c/d#e/f") == "a b.png"
    assert base_name("s3://bucket/maps/a%20b?c.png") == "a%20b?c.png"
    assert base_name("maps/a.png") == "a.png"


@pytest.mark.parametrize(
    ("path", "pattern", "fits"),
    [
        ("a.png", "*.png", True),
        ("b/a.png", "*.png", False),
        ("b/a.png", "*/*.png", True),
        ("b/a.png", "**/*.png", True),
        ("a.png", "**/*.png", True),
        ("c/b/a.png", "**/*.png", True),
        ("c/b/a.png", "c/**/a.png", True),
        ("c/a.png", "c/**/a.png", True),
        ("c/b/a.png", "c/**", True),
        ("c/b/a.png", "**/c/a.png", False),
        ("A.png", "a.png", False),
        ("c", "c/*", False),
    ],
)
def test_a_pattern_is_held_against_a_path_folder_by_folder(path, pattern, fits):
    assert _fits(path.split("/"), pattern.split("/")) == fits


def test_parts_have_numbers_and_come_in_their_order():
    names = ["part-00010.csv", "part-00009.csv", "part-100000.csv", "part-00000.csv"]
    others = ["part-0001.csv", "part-00001.txt", "xpart-00001.csv", "part-00001.csv.gz", "part-00001"]
    assert part_names(names + others) == [
        "part-00000.csv",
        "part-00009.csv",
        "part-00010.csv",
        "part-100000.csv",
    ]
    for ending in ("jsonl", "parquet"):
        assert part_names([f"part-00000.{ending}"]) == [f"part-00000.{ending}"]
