"""A URL works wherever a path does: every command gives the same from a bucket and into it."""

import re
from functools import partial

import pytest

from tests.run_cli import contents, road_map, rollcli, rollcli_process, write_maps, write_pair

CALIBRATION = "P0: 200 0 80 0 0 200 60 0 0 0 1 0\nP1: 200 0 80 -100 0 200 60 0 0 0 1 0\n"
MAPS = 3
# what each command reads and writes: "@/" stands for a folder on disk, or for a prefix of a bucket
LINES = {
    "a list and a calibration": "estimate --files-from @/list.txt --calib @/calib.txt -o @/listed.jsonl",
    "folders": "estimate @/maps/ --calib @/calib/ --mask @/mask.png -o @/each.csv --derotated @/up",
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


def below(bucket):
    """What reads an object, by its path; a result of one part under the name of its folder."""
    from rollcli.files.storage import read_bytes
    from rollcli.files.stores.objects import list_objects

    urls = [url for url, _ in list_objects(f"{bucket}/")]
    names = [re.sub(r"/part-00000\.\w+$", "", url.removeprefix(f"{bucket}/")) for url in urls]
    return {name: partial(read_bytes, url) for name, url in zip(names, urls, strict=True)}


@pytest.mark.parametrize("what", LINES)
def test_a_url_works_as_a_path_does(places, store, what):
    folder, bucket = places
    if "report" in what:
        pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    before = contents(folder).keys()
    here = rollcli(*LINES[what].replace("@/", "").split(), cwd=folder)
    run = rollcli_process if LINES[what].startswith(WITH_WORKERS) else rollcli
    there = run(*LINES[what].replace("@/", f"{bucket}/").split(), cwd=folder, **store)
    assert (here.status, there.status) == (0, 0), there.err
    found = below(bucket)
    written = contents(folder)
    assert written.keys() > before
    for name in written.keys() - before:
        if not name.endswith((".run.json", ".inputs", ".html")):
            assert found[name]().replace(f"{bucket}/".encode(), b"") == written[name], name
        elif name.endswith(".html"):
            counted = [data.count(b"data:image/webp") for data in (found[name](), written[name])]
            assert counted[0] == counted[1] > 0
