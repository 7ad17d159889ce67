"""A result that came from elsewhere makes nobody ask a server for what it names."""

import threading
from dataclasses import replace
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from tests.report.results import row, write_result
from tests.run_cli import rollcli, write_maps


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder, and notes who is asked for."""

    def do_GET(self):
        self.server.asked.append(self.path)
        super().do_GET()

    def log_message(self, *_):
        pass


@pytest.fixture
def server(tmp_path):
    folder = tmp_path / "served"
    write_maps(folder, 1)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=folder)) as server:
        server.asked, server.folder = [], folder
        server.address = f"http://127.0.0.1:{server.server_port}"
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield server
        server.shutdown()


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
