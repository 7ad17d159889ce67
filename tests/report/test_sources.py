"""What a report asks remote places for."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest

from tests.report.results import row, write_result
from tests.run_cli import rollcli, write_maps
from tests.web_server import file_below, web_server


@pytest.fixture
def server(tmp_path):
    """A server over the folder `served`: its address, what it was asked for, and the folder."""
    write_maps(tmp_path / "served", 1)
    with web_server(partial(file_below, tmp_path / "served")) as (address, asked):
        yield SimpleNamespace(address=address, asked=asked, folder=tmp_path / "served")


def report(folder, result, server, *arguments):
    keys = {"AWS_ENDPOINT_URL": server.address, "AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b"}
    return rollcli("report", result, "-o", "page.html", *arguments, cwd=folder, **keys)


@pytest.mark.slow
def test_remote_images_of_a_local_result_are_asked_for_with_fetch_alone(tmp_path, server):
    url = f"{server.address}/frame0.png"
    names = (url, url.replace("http", "HTTP"), "s3://private/frame0.png", "az://private/frame0.png")
    write_result(tmp_path / "rolls.csv", [*map(row, names), replace(row("frame0.png"), right_file=url)])
    done = report(tmp_path, "rolls.csv", server)
    assert (done.status, server.asked) == (3, [])
    assert "is remote, and the result does not lie there; --fetch follows it" in done.err
    assert "5 of 5 frames without pictures" in done.err

    write_maps(tmp_path / "out" / "derotated", 1)
    assert report(tmp_path, "rolls.csv", server, "--images", "out", "--overwrite").status == 0
    assert server.asked == []

    write_result(tmp_path / "rolls.csv", [row(url)])
    assert report(tmp_path, "rolls.csv", server, "--fetch", "--overwrite").status == 0
    assert "/frame0.png" in server.asked


def test_rows_of_a_result_in_the_same_store_are_followed_and_no_others(tmp_path, server):
    other = server.address.replace("127.0.0.1", "localhost")
    rows = [row(f"{server.address}/frame0.png"), row(f"{other}/other.png")]
    write_result(server.folder / "rolls.csv", rows)

    done = report(tmp_path, f"{server.address}/rolls.csv", server)

    assert done.status == 3
    assert set(server.asked) == {"/rolls.csv", "/frame0.png"}


def test_images_that_the_run_wrote_come_before_others_of_a_kinds_name(tmp_path):
    pair = ["--left", "rig/left", "--right", "rig/right", "--num-disparities", "32"]
    rollcli("simulate", "rig", "--frames", "1", "--size", "200x120", "--dips", "0", "-q", cwd=tmp_path)
    images = ["--disparity", "rig/maps", "--heights", "rig/over"]
    assert rollcli("estimate", *pair, "-o", "rig/rolls.csv", *images, cwd=tmp_path).status == 0
    assert rollcli("estimate", *pair, "-o", "rig/a.csv", "--derotated", "rig/up", cwd=tmp_path).status == 0

    def read(result):
        done = rollcli("report", result, "--images", "rig", "-o", "page.html", "--dry-run", cwd=tmp_path)
        return [line.split()[1] for line in done.out.splitlines() if line.startswith("read ")][3:]

    # rig/disparity and rig/heights are the true ones of the simulation
    assert read("rig/rolls.csv") == ["rig/maps/frame_0001.png", "rig/over/frame_0001.tif"]
    assert read("rig/a.csv") == ["rig/up/frame_0001.png"]
