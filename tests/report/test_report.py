"""`rollcli report` from the outside."""

import base64
import hashlib
import html
import json
import os
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime, timezone

import cv2
import numpy as np
import pytest

from rollcli.files.results import read_result
from rollcli.pictures.vdisparity import BOTTOM_MARGIN
from rollcli.report import pictures, run
from tests.report.results import row, write_result
from tests.run_cli import interrupt_in, road_map, rollcli, write_kitti, write_maps
from tests.slow import mostly_slow

pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
pytest.importorskip("jinja2", reason="jinja2, of the extra report, is not here")

PICTURES = re.compile(r'<img src="data:image/webp;base64,([^"]+)"')


@pytest.fixture(scope="module")
def estimated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("estimated")
    write_maps(folder / "maps", 4)
    (folder / "maps" / "frame2.png").write_bytes(b"")
    images = ["--derotated", "out/upright", "--vdisparity", "out/v"]
    assert rollcli("estimate", "maps", "-o", "out/rolls.csv", *images, "-j1", cwd=folder).status == 3
    return folder


@pytest.fixture
def folder(tmp_path, estimated):
    return shutil.copytree(estimated, tmp_path, dirs_exist_ok=True)


def report(folder, *arguments):
    return rollcli("report", *arguments, "-o", "page.html", cwd=folder)


def page_of(folder):
    return (folder / "page.html").read_text("utf-8")


def pictures_of(folder):
    """The pictures of a page, base64."""
    return PICTURES.findall(page_of(folder))


def seen(picture):
    return cv2.imdecode(np.frombuffer(base64.b64decode(picture), np.uint8), cv2.IMREAD_COLOR).astype(float)


def estimate_pairs(folder, frames, size, *images):
    """Render pairs, and estimate them."""
    rollcli("simulate", "rig", "--frames", frames, "--size", size, "-q", cwd=folder)
    pair = ["--left", "rig/left", "--right", "rig/right", "--num-disparities", "32"]
    rollcli("estimate", *pair, "-o", "rolls.csv", *images, cwd=folder)


def test_a_page_holds_everything_it_shows(folder):
    done = report(folder, "out/rolls.csv")
    assert (done.status, done.out) == (0, "")
    text = page_of(folder)
    assert len(PICTURES.findall(text)) == 5 * 3
    assert text.count('<button type="button" data-show="heights"') == 3 + 1  # and one for all
    assert "is empty" in text
    # plotly's script names addresses of maps that it could draw; the page itself asks for nothing
    outside_of_scripts = re.sub(r"<script.*?</script>", "", text, flags=re.S)
    assert not re.search(r"(src|href|url)\s*[=(]\s*[\"']?(https?:|//)", outside_of_scripts)
    assert "<script src" not in text


def test_the_summary_says_options_version_counts_the_sign_and_when_the_result_was_written(folder):
    report(folder, "out/rolls.csv")
    text = html.unescape(
        re.sub(r"\s+", " ", re.sub(r"<(script|style).*?</\1>|<[^>]+>", " ", page_of(folder), flags=re.S))
    )
    run = json.loads((folder / "out" / "rolls.csv.run.json").read_text())
    written = datetime.fromtimestamp((folder / "out" / "rolls.csv").stat().st_mtime, timezone.utc)
    for said in (
        *(f"rollcli {run['rollcli']}", "--max-roll 45", "inputs from maps"),
        *("frames 4 ok 3 suspect 0 failed 1", "Shown: 3 of 3 frames with an angle."),
        *("nine in ten frames", "its right end is up"),
        f"result written {written:%Y-%m-%d %H:%M} UTC",
    ):
        assert said in text


@pytest.mark.parametrize("images", mostly_slow(["out", "out/upright", "out/v"], "out"))
def test_pictures_come_from_the_images_that_estimate_wrote(folder, images):
    shutil.rmtree(folder / "maps")
    done = report(folder, "out/rolls.csv", "--images", images)
    assert done.status == 0, done.err
    (page,) = folder.glob("*.html")
    assert f", {page.stat().st_size / 1e6:.1f} MB" in done.err
    # of the map itself nothing is left; the level map gives its v-disparity too
    assert len(pictures_of(folder)) == (3 if images == "out/v" else 6)
    assert page_of(folder).count("maps/frame0.png: there is no map of it among the images") == 1


def test_only_the_pages_own_scripts_and_styles_are_active_and_nothing_is_requested(folder):
    assert report(folder, "out/rolls.csv", "--gallery", "1").status == 0
    text = page_of(folder)
    policy = html.unescape(re.search(r'Content-Security-Policy" content="([^"]+)"', text)[1])
    rules = {name: sources for name, *sources in map(str.split, policy.split(";"))}
    assert rules["default-src"] == ["'none'"]
    assert rules["img-src"] == ["data:", "blob:"]
    markup = re.sub(r"<script.*?</script>", "", text, flags=re.S)  # a plotly's script may hold tags of a logo
    plotly_makes = {"script": [], "style": [""]}  # an empty element, which its script fills by rules
    for kind, source in (("script", text), ("style", markup)):
        inline = re.findall(rf'<{kind}(?: type="text/plain")?(?: id=\S+)?>(.*?)</{kind}>', source, re.S)
        inline += plotly_makes[kind]
        digests = [base64.b64encode(hashlib.sha256(each.encode()).digest()).decode() for each in inline]
        assert set(rules[f"{kind}-src"]) == {f"'sha256-{digest}'" for digest in digests}
    assert not re.search(r"<[^>]+ (style|on\w+)=", markup)


@pytest.mark.slow
def test_pairs_are_shown_from_their_computed_maps_or_matched_anew(tmp_path):
    estimate_pairs(tmp_path, "2", "200x120", "--disparity", "maps", "--save-as", "npy")
    assert report(tmp_path, "rolls.csv", "--images", "maps").status == 0
    from_maps = pictures_of(tmp_path)
    shutil.rmtree(tmp_path / "maps")
    assert report(tmp_path, "rolls.csv", "--overwrite").status == 0
    anew = pictures_of(tmp_path)
    # without the left image there is no road on it, and heights are not drawn over it
    matched = [each for place, each in enumerate(anew) if place % 6 not in (0, 3)]
    assert matched == [each for place, each in enumerate(from_maps) if place % 5 != 2]
    assert (len(anew), len(from_maps)) == (12, 10)


@pytest.mark.slow
def test_the_road_is_tinted_on_the_left_image_of_a_pair_as_estimate_draws_it(tmp_path):
    estimate_pairs(tmp_path, "1", "320x200", "--road-mask", "out/road_mask")
    (drawn,) = (cv2.imread(str(path)) for path in (tmp_path / "out" / "road_mask").iterdir())
    for images in ([], ["--images", "out"]):
        assert report(tmp_path, "rolls.csv", *images, "--overwrite").status == 0
        assert np.abs(seen(pictures_of(tmp_path)[0]) - drawn).mean() < 8  # WebP loses a little


def test_a_road_that_the_result_was_not_made_from_is_not_shown(tmp_path):
    estimate_pairs(tmp_path, "1", "320x200")
    (made,) = read_result(tmp_path / "rolls.csv").rows
    write_result(tmp_path / "rolls.csv", [replace(made, roll_deg=made.roll_deg + 0.01)])
    assert report(tmp_path, "rolls.csv").status == 0
    assert len(pictures_of(tmp_path)) == 5


def test_an_interrupted_report_writes_nothing(folder, monkeypatch):
    interrupt_in(monkeypatch, run, "take_pictures")
    done = report(folder, "out/rolls.csv")
    assert (done.status, done.err) == (130, "rollcli: interrupted; nothing is written\n")
    assert not (folder / "page.html").exists()


@pytest.mark.slow
def test_ten_thousand_frames_stay_under_30_mb(tmp_path, monkeypatch):
    noise = np.random.default_rng(0).uniform(1, 90, (375, 1242))  # no picture is larger than one of noise
    write_kitti(tmp_path / "map.png", noise)
    # all are of one map and three rolls, so that each picture is encoded once
    rolls = [1.001 + i % 3 for i in range(10_000)]
    rows = [row("map.png", roll, status="suspect" if i % 50 else "ok") for i, roll in enumerate(rolls)]
    write_result(tmp_path / "rolls.csv", [replace(each, width=1242, height=375) for each in rows])
    encode, encoded = pictures._encoded, {}

    def encode_once(picture):
        key = picture.shape, picture.tobytes()
        return encoded.get(key) or encoded.setdefault(key, encode(picture))

    monkeypatch.setattr(pictures, "_encoded", encode_once)
    assert report(tmp_path, "rolls.csv").status == 0
    assert (tmp_path / "page.html").stat().st_size < 30e6


def test_a_result_from_a_pipe_and_a_page_to_one(folder):
    result = (folder / "out" / "rolls.csv").read_text()
    done = rollcli("report", "-", "-o", "-", "--gallery", "1", "-q", cwd=folder, stdin=result)
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("<!doctype html>")
    assert done.out.endswith("</html>")
    assert len(PICTURES.findall(done.out)) == 5
    assert not (folder / "-").exists()


def test_a_page_to_a_device_or_pipe_goes_into_it_and_leaves_it_there(folder):
    pipe = folder / "pipe"
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as reader:
        page = reader.submit(pipe.read_text, "utf-8")
        assert rollcli("report", "out/rolls.csv", "-o", "pipe", "--gallery", "0", cwd=folder).status == 0
    assert page.result().endswith("</html>")
    assert pipe.is_fifo()


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["px", "depth"])
def test_heights_are_shown_as_estimate_drew_them_or_made_in_the_same_colours(tmp_path, encoding):
    v, u = np.mgrid[:120, :160]
    road = np.maximum(0.4 * (v - 30) + 0.1 * (u - 80), 0).astype(np.float32)
    road[80:90, 60:100] += 1.0
    (tmp_path / "maps").mkdir()
    with np.errstate(divide="ignore"):
        np.save(tmp_path / "maps" / "a.npy", road if encoding == "px" else 200 * 0.5 / (road + 5))
    # unequal focal lengths and doffs count, too
    cameras = "cam0=[200 0 79.5; 0 300 20; 0 0 1]\ncam1=[200 0 84.5; 0 300 20; 0 0 1]\nbaseline=500\n"
    (tmp_path / "calib.txt").write_text(cameras)
    given = ("--calib", "calib.txt", "--encoding", encoding, "--heights-preview", "out/heights_preview")
    rollcli("estimate", "maps", "-o", "rolls.csv", *given, cwd=tmp_path)
    (drawn,) = (cv2.imread(str(path)) for path in (tmp_path / "out" / "heights_preview").iterdir())
    for images in ([], ["--images", "out"]):
        assert report(tmp_path, "rolls.csv", *images, "--overwrite").status == 0
        off = np.abs(seen(pictures_of(tmp_path)[0 if images else 2]) - drawn).mean()
        assert off < 4  # WebP loses a little


@pytest.mark.slow
def test_a_derotated_map_of_depths_is_shown_in_pixels_or_not_at_all(tmp_path):
    np.save(tmp_path / "a.npy", 50 / road_map())
    rig = ["--focal", "100", "--principal-point", "80,9", "--baseline", "0.5", "--encoding", "depth"]
    rollcli("estimate", "a.npy", *rig, "-o", "rolls.csv", "--derotated", "out/derotated", cwd=tmp_path)
    ways = (["--overwrite"], ["--overwrite", "--images", "out"])
    shown = [report(tmp_path, "rolls.csv", *way) and seen(pictures_of(tmp_path)[-1]) for way in ways]
    assert np.abs(shown[0] - shown[1]).mean() < 0.5
    (tmp_path / "rolls.csv.run.json").write_text('{"options": {"encoding": "depth"}}')
    assert [report(tmp_path, "rolls.csv", *way).status for way in ways] == [3, 3]


@pytest.mark.slow
def test_results_of_several_runs_are_drives_and_shards_are_one(tmp_path):
    for name, roll in (("a", 1.0), ("b", -2.0)):
        turns = np.random.default_rng(5).normal(roll, 0.05, 40)
        rows = [row(f"m/{at:03}.png", turn, 0.0002) for at, turn in enumerate(turns)]
        write_result(tmp_path / f"{name}.csv", rows)
        (tmp_path / f"{name}.csv.run.json").write_text(f'{{"rollcli": "{name}", "options": {{}}}}')

    assert rollcli("report", "a.csv", "b.csv", "-o", "page.html", "--gallery", "0", cwd=tmp_path).status == 0

    page = page_of(tmp_path)
    assert re.search(r"<h1>Roll of 80 frames</h1>.*<code>a\.csv, b\.csv</code>.*>rollcli a, b<", page, re.S)
    assert re.search(r'class="value">roll −[12]\.\d+ ± [\d.]+° <span>in m \(b\.csv\)</span>', page)
    assert "m (b.csv) differs from m (a.csv) by -" in page
    assert "<dt>interval of a frame</dt><dd>± 0.001°</dd>" in page  # and not of nothing

    for name, index in (("a", 1), ("b", 2)):
        (tmp_path / f"{name}.csv.run.json").write_text(json.dumps({"options": {"shard": f"{index}/2"}}))
    again = ("--overwrite", "--gallery", "0", "-o", "page.html")
    assert rollcli("report", "b.csv", "a.csv", *again, cwd=tmp_path).status == 0
    assert re.search(r'class="value">roll [−\d]', page_of(tmp_path))
    rows = re.search(r'id="rows">(.*?)</script>', page_of(tmp_path), re.DOTALL)[1]
    first = [each[3] for each in json.loads(rows)["rows"][:4]]
    assert [number > 0 for number in first] == [True, False, True, False]
    assert "named twice" in rollcli("report", "a.csv", "a.csv", *again, cwd=tmp_path).refused()


def test_the_captions_say_what_the_map_is_turned_by_and_both_of_its_counts_have_one_scale(tmp_path):
    write_kitti(tmp_path / "maps" / "frame0.png", 1.04 * road_map(0.2))
    rig = ["P0: 100 0 80 0 0 200 60 0 0 0 1 0", "P1: 100 0 80 -50 0 200 60 0 0 0 1 0"]
    (tmp_path / "calib.txt").write_text("\n".join(rig))
    rollcli("estimate", "maps", "--calib", "calib.txt", "-o", "rolls.csv", cwd=tmp_path, status=0)
    assert report(tmp_path, "rolls.csv").status == 0
    (only,) = read_result(tmp_path / "rolls.csv").rows
    assert abs(only.image_roll_deg - only.roll_deg) > 0.5
    (turned,) = set(re.findall(r"Map, de-rotated by ([+−\d.]+)°", page_of(tmp_path)))
    assert float(turned.replace("−", "-")) == pytest.approx(only.image_roll_deg, abs=0.006)
    before, after = (seen(each)[-BOTTOM_MARGIN:] for each in pictures_of(tmp_path)[-2:])
    assert np.abs(before - after).mean() < 1
