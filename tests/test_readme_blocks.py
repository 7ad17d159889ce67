"""Every block of the README does what it says: here, or in the test that is named beside it."""

import math
import re
import shlex
import shutil
from pathlib import Path

import click
import cv2
import numpy as np
import pytest

from rollcli import assess_rig
from tests.readme_tables import commands
from tests.run_cli import ROOT, contents, keep_rows, road_map, rollcli, write_kitti, write_program
from tests.test_readme import PAGES, README, make

COMMANDS = dict(commands())
BLOCKS = [text for _, text in re.findall(r"^```(\w*)\n(.*?)^```", README, flags=re.M | re.S)]
SAMPLES = ROOT / "sample_data"
ELSEWHERE = {
    "rollcli estimate sample_data/maps": "test_readme: the first run prints what it shows",
    "rollcli: sample_data/maps/frame_0001.png": "test_readme: the first run prints what it shows",
    "file,right_file,status": "test_readme: the first run prints what it shows",
    "LEFT := $(wildcard left/*.png)": "test_readme: its makefile makes a page from pairs",
    ">>> import math": "test_python: the README's session in Python holds",
}
NOT_RUN = {
    "pipx install": "needs the package index; CI's build installs the program, and `make run` is run by hand",
    "@": "a citation",
}


def block(start):
    """The one block that starts like this."""
    (found,) = (each for each in BLOCKS if each.lstrip("#! ").startswith(start))
    return found


def run_block(start, cwd, **replaced):
    """Run each line of a block; text is replaced where the block is too large for a test."""
    text = block(start)
    for old, new in replaced.items():
        assert old in text, old
        text = text.replace(old, new)
    done = []
    for line in text.splitlines():
        program, *words = shlex.split(line, comments=True)
        assert program == "rollcli"
        done.append(rollcli(*words, cwd=cwd))
        assert done[-1].status == 0, (line, done[-1].err)
    return done


def maps(folder, *names):
    """Copy maps of the samples, all by default."""
    shutil.copytree(
        SAMPLES / "maps", folder, ignore=lambda _, found: set(found) - set(names) if names else set()
    )


def views(folder, left, right):
    """Copy two pairs of the samples."""
    for side, name in (("left", left), ("right", right)):
        (folder / name).mkdir()
        for number in (1, 2):
            shutil.copy(SAMPLES / side / f"frame_000{number}.png", folder / name)
    shutil.copy(SAMPLES / "calib.txt", folder)


def estimated(folder, name="rolls.csv"):
    """Estimate `maps`, copied if it is not there."""
    if not (folder / "maps").is_dir():
        maps(folder / "maps")
    assert rollcli("estimate", "maps", "-o", name, "-q", cwd=folder).status == 0


@pytest.mark.slow
def test_the_page_is_made_from_a_result_and_from_what_make_run_wrote(tmp_path):
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    maps(tmp_path / "sample_data" / "maps")
    assert rollcli("estimate", "sample_data/maps", "-o", "rolls.csv", cwd=tmp_path).status == 0
    (line,) = re.findall(r"^\t\$\(BIN\)/rollcli (.*)", (ROOT / "Makefile").read_text(), flags=re.M)
    assert rollcli(*shlex.split(line), cwd=tmp_path).status == 0
    for day, name in (("monday", "frame_0001.png"), ("tuesday", "frame_0002.png")):
        assert rollcli("estimate", f"sample_data/maps/{name}", "-o", f"{day}.csv", cwd=tmp_path).status == 0
    run_block("rollcli report rolls.csv", tmp_path)
    assert "frame_0002.png" in (tmp_path / "both.html").read_text("utf-8")
    for page in ("rolls.html", "out.html"):
        assert "frame_0004.npy" in (tmp_path / page).read_text("utf-8")


def test_a_bag(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags, of the extra bags, is not here")
    from tests.files.recordings.bag_files import disparity_image, write_bag

    def messages(store):
        for number in range(2):
            stamp = (100 + number) * 10**9
            yield "/stereo/disparity", stamp, disparity_image(store, road_map(0.05, seed=number), stamp)

    write_bag(tmp_path, "drive", "mcap", messages)
    run_block("rollcli estimate drive.mcap", tmp_path)
    assert (tmp_path / "rolls.csv").read_text().count(",ok,2.8") == 2


def test_two_folders_of_images(tmp_path):
    views(tmp_path, "image_2", "image_3")
    run_block("rollcli estimate --left image_2", tmp_path)
    assert sorted(contents(tmp_path / "maps")) == ["frame_0001.png", "frame_0002.png"]
    assert (tmp_path / "rolls.csv").read_text().count("image_3/frame_000") == 2


def test_npy_maps_with_a_mask(tmp_path):
    maps(tmp_path / "run7" / "morning", "frame_0004.npy")
    bonnet = np.full((360, 480), 255, np.uint8)
    bonnet[330:] = 0
    cv2.imwrite(str(tmp_path / "bonnet.png"), bonnet)
    run_block("rollcli estimate 'run7/**/*.npy'", tmp_path)
    assert (tmp_path / "rolls.csv").read_text().count("run7/morning/frame_0004.npy,,ok,-3.9") == 1


@pytest.mark.slow
def test_derotation_by_a_result_and_by_one_angle_and_then_v_disparity(tmp_path):
    estimated(tmp_path)
    run_block("rollcli derotate maps --from", tmp_path)
    assert contents(tmp_path / "level").keys() == contents(tmp_path / "maps").keys()
    assert contents(tmp_path / "whole").keys() == contents(tmp_path / "maps").keys()
    run_block("rollcli vdisparity level", tmp_path)
    stems = [f"frame_000{number}" for number in range(1, 6)]
    assert sorted(contents(tmp_path / "vdisparity")) == [
        f"{stem}{ending}" for stem in stems for ending in (".png", ".tif")
    ]
    assert sorted(contents(tmp_path / "figures")) == [f"{stem}.pdf" for stem in stems]


def test_pitch_and_height(tmp_path):
    views(tmp_path, "image_0", "image_1")
    run_block("rollcli estimate --left image_0", tmp_path)
    header, *rows = (line.split(",") for line in (tmp_path / "pose.csv").read_text().splitlines())
    assert all(row[header.index(name)] for row in rows for name in ("pitch_deg", "height_m"))


@pytest.mark.slow
def test_heights_of_pairs_and_of_the_maps_of_a_result(tmp_path):
    shutil.copytree(SAMPLES, tmp_path, dirs_exist_ok=True)
    run_block("rollcli estimate --left left --right right --calib calib.txt -o pairs.csv", tmp_path)
    assert len(contents(tmp_path / "seen")) == len(contents(tmp_path / "left"))
    assert len(contents(tmp_path / "over")) == len(contents(tmp_path / "maps"))


def test_the_check_in_ci_passes_a_rig_that_holds_and_fails_one_that_does_not(tmp_path):
    for index in range(40):
        write_kitti(tmp_path / "calibration" / "maps" / f"{index}.png", road_map(0.001, seed=index))
    *_, passed = run_block("rollcli estimate calibration/maps", tmp_path)
    assert "ok" in passed.out
    gate = shlex.split(block("rollcli estimate calibration/maps").splitlines()[1])[1:]
    rollcli(*("2" if word == "0" else word for word in gate), cwd=tmp_path, status=4)


@pytest.mark.slow
def test_how_wide_the_interval_of_120_frames_is():
    at_random, slowly = map(float, re.findall(r"±(0\.\d+)° where", README))
    for correlation, said in ((0.0, at_random), (0.94, slowly)):
        widths = []
        for seed in range(8):
            steps = np.random.default_rng(seed).normal(0, 0.3, 120)
            rolls = [steps[0]]
            for step in steps[1:]:
                rolls.append(correlation * rolls[-1] + math.sqrt(1 - correlation**2) * step)
            frames = {"file": [f"{i:03}.png" for i in range(120)], "status": ["ok"] * 120}
            rig = assess_rig({**frames, "roll_deg": rolls, "roll_ci95_deg": [0.05] * 120})
            widths.append(rig.now().ci95)
        assert np.median(widths) == pytest.approx(said, rel=0.15)


def test_what_the_result_says_of_the_rig(tmp_path):
    for name in ("rolls.csv", "before.csv", "after.csv"):
        estimated(tmp_path, name)
    alone, against = run_block("rollcli rig rolls.csv", tmp_path)
    assert "roll" in alone.out
    assert "roll" in against.out


def test_the_rule_of_a_makefile_accepts_frames_without_an_angle(tmp_path):
    maps(tmp_path / "maps", "frame_0001.png", "frame_0002.png")
    (tmp_path / "maps" / "frame_0003.png").write_bytes(b"no map")
    write_program(tmp_path)
    (tmp_path / "Makefile").write_text(block("rolls.csv: $(wildcard maps/*.png)"))
    done = make(tmp_path, "rolls.csv")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "rolls.csv").read_text().count(",ok,") == 2


def test_a_long_run_continues_to_the_same_bytes(tmp_path):
    maps(tmp_path / "maps")
    line = block("rollcli estimate maps -o rolls.csv --derotated").replace(" --resume", "")
    assert rollcli(*shlex.split(line)[1:], cwd=tmp_path).status == 0
    whole = contents(tmp_path)
    keep_rows(tmp_path / "rolls.csv", 3, 20)
    run_block("rollcli estimate maps -o rolls.csv --derotated", tmp_path)
    assert contents(tmp_path) == whole


@pytest.mark.slow
def test_a_bucket(tmp_path, bucket):
    from rollcli.files.storage import list_names, write_bytes

    pytest.importorskip("pyarrow", reason="pyarrow, of the extra parquet, is not here")
    write_bytes(f"{bucket}/run7/frame_0001.png", (SAMPLES / "maps" / "frame_0001.png").read_bytes())
    words = shlex.split(block("rollcli estimate s3://").replace("s3://drives", bucket))[1:]
    rollcli(*words, cwd=tmp_path, status=0)
    assert list(list_names(f"{bucket}/run7-level")) == ["frame_0001.png"]
    assert [name for name in list_names(f"{bucket}/run7.parquet") if name.endswith(".parquet")]


@pytest.mark.slow
def test_a_simulation_of_the_rig_of_fewer_and_smaller_frames(tmp_path):
    smaller = {
        "--frames 200": "--frames 2",
        "--size 1280x720": "--size 320x180",
        "--focal 700": "--focal 175",
    }
    *_, accuracy = run_block("rollcli simulate rig", tmp_path, **smaller)
    assert re.search(r"frames compared +2\n", accuracy.out)


def test_every_block_is_run_or_says_why_not():
    here = set(re.findall(r'block\(\s*"([^"]+)"', Path(__file__).read_text("utf-8")))
    for starts in BLOCKS:
        known = [each for each in (*here, *ELSEWHERE, *NOT_RUN) if starts.startswith(each)]
        assert len(known) == 1, starts


def test_the_programs_of_the_project_that_it_names_are_there():
    for module in re.findall(r"`python -m (tests[.\w]+)", README):
        assert (ROOT / f"{module.replace('.', '/')}.py").is_file()
    scripts = re.findall(r"`python (tests/[\w/]+\.py)", README)
    assert scripts
    assert [each for each in scripts if not (ROOT / each).is_file()] == []


def lines_of(page):
    """Yield the words of each command line of rollcli in the blocks of a page."""
    for text in re.findall(r"^```(?:sh|make)?\n(.*?)^```", page.read_text("utf-8"), flags=re.M | re.S):
        for line in text.replace("\\\n", " ").splitlines():
            for part in re.split(r"\||&&|;", line.partition(" #")[0]):
                words = (
                    shlex.split(part, comments=True)
                    if part.count('"') % 2 == part.count("'") % 2 == 0
                    else []
                )
                if "rollcli" in words[:1]:
                    yield words[1:]


WITH_COMMANDS = [page for page in PAGES if any(lines_of(page))]


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_line_of_every_page_is_one_that_the_program_takes(page):
    for words in lines_of(page):
        variable = any("$" in word for word in words)  # of a shell or a Makefile
        if words and not (words[0].startswith("-") or variable or "--config" in words):
            name = " ".join(words[:2]) if words[0] == "evaluate" else words[0]
            context = COMMANDS[name].command.make_context(name, words[len(name.split()) :])
            assert isinstance(context, click.Context)
