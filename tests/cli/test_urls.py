"""A URL works wherever a path does, and one that names no file is refused."""

import re

import pytest

from rollcli.files.stores import locations
from rollcli.files.stores.locations import names_a_file
from tests.object_store import objects_below
from tests.run_cli import contents, road_map, rollcli, rollcli_process, rows_of, write_maps, write_pair
from tests.slow import mostly_slow
from tests.web_server import response, web_server

CALIBRATION = "P0: 200 0 80 0 0 200 60 0 0 0 1 0\nP1: 200 0 80 -100 0 200 60 0 0 0 1 0\n"
MAPS = 3


# what each command reads and writes: "@/" stands for a folder on disk, or for a prefix of a bucket
LINES = {
    "a list and a calibration": "estimate --files-from @/list.txt --calib @/calib.txt -o @/listed.jsonl",
    "folders": "estimate @/maps/ --calib @/calib/ --mask @/mask.png -o @/each.csv --derotated @/up "
    "--heights @/h --heights-preview @/seen",
    "pairs": "estimate --left @/left --right @/right --num-disparities 32 -o @/pairs.csv --road-mask @/road",
    "derotate": "derotate @/maps/*.png --from @/rolls.csv -o @/level",
    "vdisparity": "vdisparity @/maps --calib @/calib.txt -o @/counts --counts",
    "disparity": "disparity --left @/left --right @/right --num-disparities 32 -o @/computed",
    "rig": "rig @/rolls.csv --format json -o @/rig.json",
    "evaluate accuracy": "evaluate accuracy @/rolls.csv --truth @/truth.csv --format csv -o @/accuracy.csv",
    "report": "report @/rolls.csv -o @/page.html",
    "report of images": "report @/rolls.csv --images @/level-images -o @/shown.html",
}


# these work on frames: with URLs, in worker processes, each of which opens its own stores
WITH_WORKERS = ("estimate", "derotate", "vdisparity", "disparity")


@pytest.fixture(scope="module")
def places(store, tmp_path_factory):
    """A folder with all that the commands read, and a prefix with the same."""
    folder = tmp_path_factory.mktemp("urls")
    write_maps(folder / "maps", MAPS)
    for index in range(2):
        write_pair(folder, f"{index}.png", road_map(0.02 * index, height=80) / 2, seed=index)
    (folder / "mask.png").write_bytes((folder / "maps" / "frame0.png").read_bytes())
    (folder / "calib").mkdir()
    for index in range(MAPS):
        (folder / "calib" / f"frame{index}.txt").write_text(CALIBRATION)
    (folder / "calib.txt").write_text(CALIBRATION)
    (folder / "truth.csv").write_text("file,roll_deg\n" + "".join(f"frame{i},0\n" for i in range(MAPS)))
    line = ("estimate", "maps", "-o", "rolls.csv", "--derotated", "level-images/derotated")
    assert rollcli(*line, cwd=folder).status == 0
    with pytest.MonkeyPatch.context() as patch:
        for name, value in store.items():
            patch.setenv(name, value)
        from rollcli.files.storage import write_bytes

        bucket = "s3://maps/urls"
        for name, data in contents(folder).items():
            place = "rolls.csv/part-00000.csv" if name == "rolls.csv" else name
            text = data.replace(b"maps/frame", f"{bucket}/maps/frame".encode()) if "rolls" in name else data
            write_bytes(f"{bucket}/{place}", text)
        write_bytes(f"{bucket}/list.txt", f"{bucket}/maps/frame2.png\n{bucket}/maps/frame0.png\n".encode())
        (folder / "list.txt").write_text("maps/frame2.png\nmaps/frame0.png\n")
        yield folder, bucket


@pytest.mark.parametrize("what", mostly_slow(LINES, "folders", "rig"))
def test_a_url_works_as_a_path_does(places, store, what):
    folder, bucket = places
    if "report" in what:
        pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    before = contents(folder).keys()
    here = rollcli(*LINES[what].replace("@/", "").split(), cwd=folder)
    run = rollcli_process if LINES[what].startswith(WITH_WORKERS) else rollcli
    there = run(*LINES[what].replace("@/", f"{bucket}/").split(), cwd=folder, **store)
    assert (here.status, there.status) == (0, 0), there.err
    # a result of one part under the name of its folder
    found = {re.sub(r"/part-00000\.\w+$", "", name): data for name, data in objects_below(bucket).items()}
    written = contents(folder)
    assert written.keys() > before
    for name in written.keys() - before:
        if not name.endswith((".run.json", ".inputs", ".html")):
            assert found[name].replace(f"{bucket}/".encode(), b"") == written[name], name
        elif name.endswith(".html"):
            counted = [data.count(b"data:image/webp") for data in (found[name], written[name])]
            assert counted[0] == counted[1] > 0


@pytest.fixture
def server(tmp_path):
    """Gives the same map under every name."""
    write_maps(tmp_path / "map", 1)
    data = (tmp_path / "map" / "frame0.png").read_bytes()
    with web_server(lambda _: response(200, data)) as (address, _):
        yield address


BAD = (
    *("", "a%00.png", "a/", "%2e%2e", "a/%2e%2e", "%2E", "%2F", "..%2f..%2f"),
    *("..%5C..%5CStartup%5Cevil.png", "C:%5CStartup%5Cevil.png", "c:evil.png"),
)


@pytest.mark.parametrize("name", BAD)
def test_a_url_that_names_no_file_is_that_frames_error_and_writes_nothing(tmp_path, server, name):
    cwd = tmp_path / "cwd"
    cwd.mkdir()
    maps = [f"{server}/{name}", f"{server}/good.png"]
    done = rollcli("estimate", *maps, "-o", "rolls.csv", "--derotated", "up", "--vdisparity", "v", cwd=cwd)
    assert done.status == 3, done.err
    rows = {each["file"]: each for each in rows_of((cwd / "rolls.csv").read_text())}
    assert "names no file below a folder" in rows[maps[0]]["message"]
    assert rows[maps[1]]["status"] == "ok"
    results = ["rolls.csv", "rolls.csv.inputs", "rolls.csv.run.json"]
    assert sorted(contents(cwd)) == [*results, "up/good.png", "v/good.png"]
    assert sorted(contents(tmp_path / "map")) == ["frame0.png"]


def test_names_of_objects_are_checked_likewise(tmp_path, bucket, store):
    import boto3

    write_maps(tmp_path / "map", 1)
    data = (tmp_path / "map" / "frame0.png").read_bytes()
    names = ["a\\..\\..\\evil.png", "C:\\evil.png", "a:b.png", "2024-05-01T12:00:00.png"]
    keys = {name.lower(): store[name] for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY")}
    client = boto3.client("s3", "us-east-1", endpoint_url=store["AWS_ENDPOINT_URL"], **keys)
    for name in names:
        client.put_object(Bucket="maps", Key=f"{tmp_path.name}/{name}", Body=data)
    done = rollcli("estimate", f"{bucket}/", "-o", "r.csv", "--derotated", "up", cwd=tmp_path, **store)
    assert done.status == 3, done.err
    rows = rows_of((tmp_path / "r.csv").read_text())
    assert {row["file"].rsplit("/")[-1]: row["status"] for row in rows} == {
        "a\\..\\..\\evil.png": "error",
        "C:\\evil.png": "error",
        "a:b.png": "error",
        "2024-05-01T12:00:00.png": "ok",
    }
    assert sorted(contents(tmp_path / "up")) == ["2024-05-01T12:00:00.png"]


def test_names_that_windows_gives_to_devices_and_streams_are_no_files_there(monkeypatch):
    names = ["NUL", "con.png", "COM1.tif", "a.png:stream", "a?.png", "a.png.", "a.png "]
    names += ["x/aux/a.png", "a\x1f"]
    assert all(map(names_a_file, names))
    monkeypatch.setattr(locations, "_ON_WINDOWS", True)
    assert not any(map(names_a_file, names))
    assert names_a_file("run 7/frame (2).png")


@pytest.mark.parametrize("kind", mostly_slow(["db3", "mcap", "bag"], "db3"))
def test_the_threads_of_a_worker_that_wait_for_a_url_read_one_bag(tmp_path, server, kind):
    from tests.files.recordings.bag_files import write_bag
    from tests.files.recordings.test_bags import drive

    path = write_bag(tmp_path, "drive", kind, drive(6)).name
    expected = rollcli("estimate", path, cwd=tmp_path)
    done = rollcli("estimate", path, "--mask", f"{server}/mask.png", "-j", "2", cwd=tmp_path)
    assert (done.status, done.out) == (0, expected.out)
