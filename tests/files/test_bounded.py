"""What is read is bounded before it is read: in bytes, and in time where a server gives it."""

import io
import os
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from rollcli.errors import InputError
from rollcli.files import bounded
from rollcli.files.bounded import read_given
from rollcli.files.storage import read_bytes
from tests.binary_files import npy_header
from tests.run_cli import command, ended, environment, write_maps
from tests.web_server import web_server

pytestmark = pytest.mark.slow

GIB = 2**30


def limited(*arguments, cwd, memory=2 * GIB, stdin=None):
    """Run the program with so much memory, and at most 20 s."""
    import resource

    return ended(
        command(*arguments),
        cwd,
        env=environment(OPENBLAS_NUM_THREADS="1"),
        stdin=stdin,
        timeout=20,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory)),
    )


def sparse(path, size, start=b""):
    path.write_bytes(start)
    os.truncate(path, size)
    return path


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs /dev/zero")
@pytest.mark.parametrize("source", ["/dev/zero", "big"])
@pytest.mark.parametrize(
    "words",
    [
        "report {} --svg s",
        "rig {}",
        "rig -",
        "derotate maps --from {} -o o",
        "estimate --files-from {}",
        "estimate -",
        "estimate maps --config {}",
        "estimate maps --calib {}",
        "estimate maps --mask {}",
        "estimate --left maps --right maps --align {}",
        "estimate {}",
        "evaluate accuracy r.csv --truth {}",
        "evaluate accuracy {} --truth r.csv",
    ],
)
def test_a_device_without_end_and_a_file_of_100_gib_are_refused(tmp_path, words, source):
    sparse(tmp_path / "big", 100 * GIB)
    write_maps(tmp_path / "maps", 1)
    (tmp_path / "r.csv").write_text("file,status,roll_deg\nframe0.png,ok,1\n")
    with (tmp_path / source).open("rb") as endless_one:
        done = limited(*words.format(source).split(), cwd=tmp_path, stdin=endless_one)
    of_a_row = words == "estimate {}" or (words, source) == ("estimate maps --mask {}", "big")
    assert done.returncode == (3 if of_a_row else 2), done.stderr
    assert "out of memory" not in done.stderr
    assert "internal error" not in done.stderr


def test_an_array_is_refused_by_its_header(tmp_path):
    for size, shape, reason in [
        (int(3.6 * GIB), (30000, 30000), "has 3865470566 bytes; up to 1 GB are read"),
        (800 * 2**20, (10, 10, 3), "is a 3-D array of shape"),
        (800 * 2**20, (14000, 14000), "its header claims 14000 x 14000 pixels"),
        (800 * 2**20, (30000, 30000), "is truncated"),
    ]:
        header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}"
        sparse(tmp_path / "a.npy", size, npy_header(header))
        done = limited("estimate", "a.npy", cwd=tmp_path)
        assert done.returncode == 3, done.stderr
        assert reason in done.stderr


def test_what_has_an_end_is_read_whatever_it_is(tmp_path):
    (tmp_path / "list").write_text("x")
    assert read_given(tmp_path / "list", 1) == b"x"
    (tmp_path / "list").write_text("xy")
    with pytest.raises(InputError, match="has 2 bytes; up to 1 bytes are read"):
        read_given(tmp_path / "list", 1)
    if Path("/dev/null").exists():
        assert read_given("/dev/null") == b""
    if sys.platform == "linux":
        with pytest.raises(InputError, match=f"more than {bounded._OF_DEVICES} bytes"):
            read_given("/dev/zero")


def endless(start, piece=b"x" * 2**20, pause_s=0.0):
    """An answer that begins so, and gives another piece as long as it is asked."""
    yield start
    while True:
        yield piece
        time.sleep(pause_s)


@pytest.mark.parametrize(
    "start",
    [b"HTTP/1.1 200 OK\r\n\r\n", b"HTTP/1.1 200 OK\r\nContent-Length: 1000000\r\n\r\n"],
    ids=["without length", "with length"],
)
def test_a_server_that_never_ends_is_left_after_the_time_for_the_whole(monkeypatch, start):
    monkeypatch.setenv("ROLLCLI_STORE_TIMEOUT", "1")
    with web_server(lambda _: endless(b"HTTP/1.1 200 OK\r\n" + start, b"x", 0.1)) as (url, asked):
        began = time.monotonic()
        with pytest.raises(
            InputError, match=r"too long; ROLLCLI_STORE_TIMEOUT sets the seconds .*\(1\), for up to 1 GB$"
        ):
            read_bytes(f"{url}/map.png")
        assert time.monotonic() - began < 3
        assert len(asked) == 1


def test_a_server_that_gives_ever_more_is_left_after_the_bytes_that_are_read():
    with web_server(lambda _: endless(b"HTTP/1.1 200 OK\r\n\r\n")) as (url, asked):
        with pytest.raises(
            InputError, match=r"has more than 10000000 bytes; up to 9 MB are read, within 60 s \("
        ):
            read_bytes(f"{url}/map.png", most=10**7)
        assert len(asked) == 1


def test_a_large_object_is_refused_by_what_its_server_says_of_it(monkeypatch):
    size = 100 * GIB
    head = f'HTTP/1.1 200 OK\r\nContent-Length: {size}\r\nETag: "a"\r\n'
    head += "Last-Modified: Mon, 01 Jan 2024 00:00:00 GMT\r\n\r\n"
    with web_server(lambda _: endless(head.encode())) as (url, _):
        with pytest.raises(InputError, match=f"has {size} bytes; up to 1 GB are read, within 60 s"):
            read_bytes(f"{url}/map.png")
        pytest.importorskip("obstore", reason="obstore, of the extra storage, is not here")
        monkeypatch.setenv("AWS_ENDPOINT_URL", url)
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            monkeypatch.setenv(name, "a")
        with pytest.raises(InputError, match=f"has {size} bytes; up to 1 GB are read, within 60 s"):
            read_bytes("s3://large/map.png")


@pytest.mark.parametrize(
    ("place", "said"), [("ftp://host/x", "as one of the web"), ("file:///etc/hosts", "is not allowed")]
)
def test_a_redirect_leads_to_the_web_alone(monkeypatch, place, said):
    monkeypatch.setattr(urllib.request.FTPHandler, "ftp_open", lambda *_: io.BytesIO(b"data"))

    found = f"HTTP/1.1 302 Found\r\nLocation: {place}\r\nContent-Length: 0\r\n\r\n".encode()
    with web_server(lambda _: found) as (url, _), pytest.raises(InputError, match=said):
        read_bytes(f"{url}/map.png")


def test_a_list_of_line_ends_takes_no_memory_of_their_number(tmp_path):
    (tmp_path / "list").write_bytes(b"\n" * (200 * 2**20))
    done = limited("estimate", "--files-from", "list", cwd=tmp_path)
    assert done.returncode == 2
    assert "the list is empty" in done.stderr


@pytest.mark.parametrize("inputs", ["maps", "-"])
def test_small_files_need_no_room_for_the_largest_ones(tmp_path, inputs):
    write_maps(tmp_path / "maps", 2)
    (tmp_path / "list").write_text("maps/frame0.png\nmaps/frame1.png\n")
    with (tmp_path / "list").open("rb") as stdin:
        line = ("estimate", inputs, "-j", "1", "-o", "r.csv")
        done = limited(*line, cwd=tmp_path, memory=800 * 2**20, stdin=stdin)
    assert done.returncode == 0, done.stderr


def test_a_file_that_says_no_size_is_read_to_its_end_or_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(bounded, "_PIECE", 7)
    data = bytes(range(100))
    assert bounded.read_stream(io.BytesIO(data), "f", 100) == data
    with (tmp_path / "f").open("w+b") as file:  # this one says it
        file.write(data)
        file.seek(0)
        assert bounded.read_stream(file, "f", 100) == data
    assert bounded.read_stream(io.BytesIO(b""), "f", 100) == b""
    with pytest.raises(InputError, match="f: has more than 99 bytes"):
        bounded.read_stream(io.BytesIO(data), "f", 99)
