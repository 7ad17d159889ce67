"""Bytes in an object store are read and written as those of local files are."""

import os
import socket

import pytest

from rollcli.errors import InputError, OutputError
from rollcli.files import storage
from rollcli.files.search import objects_behind
from rollcli.files.stores.locations import is_url
from rollcli.files.stores.objects import list_objects
from tests.run_cli import error_of


@pytest.fixture(params=["local", "s3"])
def folder(request, tmp_path):
    """A folder on disk, and a prefix of a bucket."""
    return str(tmp_path) if request.param == "local" else request.getfixturevalue("bucket")


@pytest.mark.parametrize("name", ["map.png", "a b/ü%20#?.png", "=x/..y"])
def test_what_was_written_is_read(folder, name):
    storage.write_bytes(f"{folder}/{name}", b"first")
    storage.write_bytes(f"{folder}/{name}", b"second")
    assert storage.read_bytes(f"{folder}/{name}") == b"second"


@pytest.mark.parametrize(("durable", "me"), [(True, "me"), (False, "")])
def test_only_the_first_creates(folder, durable, me):
    for data, owner, created in (
        (b"mine", me, True),
        (b"mine", me, True),
        (b"yours", "you", False),
        # a file does not say who wrote it: the same bytes may be of a worker that died before it could say so
        (b"mine", "you", not is_url(folder)),
        (b"yours", "", False),
    ):
        assert storage.create(f"{folder}/part", data, owner, durable=durable) == created
    assert storage.read_bytes(f"{folder}/part") == b"mine"


LEFT = (b"", b"\x89PNG", b"\x89PNG\0\0\0\0\0\0", bytes(10))
OTHERS = (b"\x89PNX", b"\x89PNG\0\n", b"\x89PNG\r\n\0abcd", bytes(11))


@pytest.mark.parametrize("there", [*LEFT, *OTHERS])
def test_what_a_power_cut_left_is_replaced_and_nothing_else(tmp_path, there):
    path, whole = tmp_path / "map.png", b"\x89PNG\r\n\0abc"
    path.write_bytes(there)
    assert not storage.create(str(path), whole)
    assert storage.create(str(path), whole, durable=False) == (there in LEFT)
    assert path.read_bytes() == (whole if there in LEFT else there)


@pytest.mark.parametrize(("make", "source"), [("mkdir", ()), ("mkfifo", ()), ("symlink", ("nothing",))])
def test_what_is_no_file_is_not_replaced_and_not_waited_for(tmp_path, make, source):
    path = tmp_path / "map.png"
    getattr(os, make)(*source, path)
    before = path.lstat()
    if make == "mkdir":
        with pytest.raises(OutputError, match="is a folder"):
            storage.create(str(path), b"data", durable=False)
    else:
        assert not storage.create(str(path), b"data", durable=False)
    assert (path.lstat().st_ino, path.lstat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert [each.name for each in tmp_path.iterdir()] == ["map.png"]


@pytest.mark.parametrize(
    ("store", "said"),
    [("closed", "does not answer"), ("silent", "TIMEOUT sets the seconds it may take (0.1), for up to 1 GB")],
)
def test_a_store_that_does_not_answer_is_one_line_without_keys(monkeypatch, store, said):
    pytest.importorskip("obstore", reason="obstore, of the extra storage, is not here")
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "PUBLIC")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "SECRET")
    monkeypatch.setenv("ROLLCLI_STORE_TIMEOUT", "0.1")
    monkeypatch.setattr("rollcli.files.stores.objects._RETRIES", 0)
    monkeypatch.setattr("rollcli.files.stores.objects._TRIES", 1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1] if store == "silent" else 9
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
        found = error_of(InputError, storage.read_bytes, f"s3://{store}/x.png")
    assert said in found
    assert "SECRET" not in found
    assert "PUBLIC" not in found


@pytest.mark.parametrize(
    "change",
    [
        lambda url: storage.write_bytes(url, b""),
        lambda url: storage.create(url, b"", "me"),
        storage.remove,
        lambda url: storage.remove_all([url]),
    ],
)
def test_web_servers_are_read_only(change):
    with pytest.raises(OutputError, match=r"^https://host/x\.png: .* not written to"):
        change("https://host/x.png")


@pytest.mark.parametrize("pattern", ["maps", "maps/**/*.png", "maps/*/*.png"])
def test_hidden_objects_and_those_in_hidden_folders_are_left_out(bucket, pattern):
    for name in ("day/a.png", "day/.b.png", ".day/c.png", "day/.e/d.png"):
        storage.write_bytes(f"{bucket}/maps/{name}", b"map")
    found = [relative for _, relative in objects_behind(f"{bucket}/{pattern}", recursive=True)]
    assert found == ["day/a.png"]


def test_prefixes_are_searched_below_when_asked_for(bucket):
    every = ["a.png", "day/b.png", "day/in/c.png", "day2/d.png"]
    for name in every:
        storage.write_bytes(f"{bucket}/maps/{name}", b"map")
    for url in (f"{bucket}/maps", f"{bucket}/maps/"):
        for recursive, expected in ((False, ["a.png"]), (True, every)):
            found = sorted(objects_behind(url, recursive=recursive))
            assert found == [(f"{bucket}/maps/{name}", name) for name in expected]
    assert list(objects_behind(f"{bucket}/map", recursive=True)) == []
    listed = sorted((url, size) for url, size, _ in list_objects(f"{bucket}/maps/day/"))
    assert listed == [(f"{bucket}/maps/day/{name}", 3) for name in ("b.png", "in/c.png")]


def test_many_are_fetched_and_removed_at_once(folder):
    names = [f"{folder}/{place}.png" for place in range(40)]
    for place, name in enumerate(names):
        storage.write_bytes(name, b"%d" % place)
    assert storage.fetch_all(names) == {name: b"%d" % place for place, name in enumerate(names)}
    storage.remove_all(names)
    assert storage.list_names(folder) == []
    assert storage.fetch_all([]) == {}
    with pytest.raises(InputError, match="no such"):
        storage.fetch_all(names)


def test_a_file_that_cannot_be_removed_is_named(tmp_path):
    (tmp_path / "folder" / "inner").mkdir(parents=True)
    for remove in (storage.remove, lambda name: storage.remove_all([name])):
        with pytest.raises(OutputError, match=r"folder: cannot be written: "):
            remove(str(tmp_path / "folder"))


def test_what_keeps_a_place_from_being_written_or_read_is_said_beforehand(bucket, tmp_path):
    storage.write_bytes(f"{bucket}/a.png", b"map")
    assert storage.write_problem("https://host/out") == "web servers are read from, not written to"
    assert storage.write_problem(bucket) == storage.write_problem("s3://maps") == ""
    assert storage.write_problem("s3://no-such-bucket/out") == "there is no such bucket"
    # of the second a row says so
    assert storage.read_problem(f"{bucket}/a.png") == storage.read_problem(f"{bucket}/none.png") == ""
    assert storage.read_problem("s3://no-such-bucket/a.png") == "there is no such bucket"
