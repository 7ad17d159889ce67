"""What the README and the pages it leads to say is so."""

import math
import re
import shutil

import cv2
import numpy as np
import pytest

from rollcli import estimate_roll, read_disparity
from tests import heights_pictures
from tests.readme_picture import MAP, PICTURE, picture
from tests.readme_tables import OPTIONS_PAGE, with_tables
from tests.run_cli import ROOT, ended, environment, rollcli, write_program

README = (ROOT / "README.md").read_text("utf-8")
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / ".github").glob("*.md")),
    *sorted((ROOT / "rollcli").rglob("README.md")),
]


def test_the_tables_of_options_are_those_of_the_commands():
    page = OPTIONS_PAGE.read_text("utf-8")
    assert with_tables(page) == page, "run: make readme"


def test_it_is_short_enough_to_read():
    assert len(README.split()) <= 2500


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_and_pictures_lead_somewhere(page):
    text = page.read_text("utf-8")
    headings = {
        re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in re.findall(r"^#+ (.*)", text, re.M)
    }
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if target.startswith("#"):
            assert target[1:] in headings, target
        elif not target.startswith("https://"):
            assert (page.parent / target).is_file(), target


def test_its_picture_and_the_angle_below_it_are_those_of_a_run():
    shown = cv2.imread(str(PICTURE), cv2.IMREAD_UNCHANGED)
    made = picture()
    assert shown.shape == made.shape
    assert np.abs(shown.astype(int) - made).mean() < 1
    assert PICTURE.stat().st_size < 300_000
    roll = estimate_roll(read_disparity(MAP))
    angle, half = math.degrees(roll.theta), math.degrees(roll.ci95)
    assert f"{angle:.2f}° ± {half:.2f}°".replace("-", "−") in README


@pytest.mark.slow
def test_its_pictures_of_heights_are_those_of_this_version(tmp_path):
    heights_pictures.main(tmp_path)
    for made in ("heights.webp", "transformed.webp"):
        shown, now = (cv2.imread(str(each / made)) for each in (heights_pictures.PICTURES, tmp_path))
        assert np.abs(shown.astype(int) - now).mean() < 1, "run: python -m tests.heights_pictures"


def test_the_first_run_prints_what_it_shows(tmp_path):
    shutil.copytree(ROOT / "sample_data" / "maps", tmp_path / "sample_data" / "maps")
    section = README.partition("\n## Run\n")[2].partition("\n## ")[0]
    line, said, rows = re.findall(r"```(?:sh)?\n(.*?)```", section, flags=re.S)
    done = rollcli(*line.split()[1:], cwd=tmp_path)
    timing = r"; [\d.]+ s, [\d.]+ frames/s"
    assert re.sub(timing, "", done.err) == re.sub(timing, "", said)
    shown = [row.split(",") for row in rows.splitlines()]
    written = [row.split(",")[:5] for row in (tmp_path / "rolls.csv").read_text().splitlines()]
    assert [row[:3] for row in shown] == [row[:3] for row in written]
    for one, other in zip(shown[1:], written[1:], strict=True):
        assert [float(each) for each in one[3:]] == pytest.approx(
            [float(each) for each in other[3:]], abs=1e-4
        )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with stereo pairs and the README's Makefile, which has been run."""
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    folder = tmp_path_factory.mktemp("make")
    rollcli("simulate", ".", "--frames", "3", "--size", "200x150", "--scene", "open", "-q", cwd=folder)
    (recipe,) = (
        each for each in re.findall(r"```make\n(.*?)```", README, flags=re.S) if "maps/%.png" in each
    )
    (folder / "Makefile").write_text(recipe)
    write_program(folder)
    done = make(folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def pairs(tmp_path, made):
    return shutil.copytree(made, tmp_path, dirs_exist_ok=True)  # keeps the times of files


def make(folder, target="rolls.html"):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    variables = environment()
    for inherited in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS"):  # of the make that runs the tests
        variables.pop(inherited, None)
    variables["PATH"] = f"{folder / 'bin'}:{variables['PATH']}"
    return ended(["make", "-j", "2", target], folder, env=variables, timeout=120)


def touch(path):
    path.write_bytes(path.read_bytes())


@pytest.mark.slow
def test_its_makefile_makes_a_page_from_pairs_and_then_has_nothing_to_do(pairs):
    assert (pairs / "rolls.html").read_text("utf-8").count("maps/frame_0003.png") >= 1
    again = make(pairs)
    assert again.returncode == 0
    assert "up to date" in again.stdout


@pytest.mark.slow
def test_its_makefile_does_anew_what_a_changed_pair_asks_for(pairs):
    touch(pairs / "right" / "frame_0002.png")
    ran = [line.split()[:2] for line in make(pairs).stdout.splitlines()]
    assert ran == [["rollcli", "disparity"], ["rollcli", "estimate"], ["rollcli", "report"]]


@pytest.mark.slow
def test_its_makefile_stops_at_a_pair_that_cannot_be_matched(pairs):
    (pairs / "right" / "frame_0002.png").write_bytes(b"no image")
    before = (pairs / "rolls.csv").read_bytes()
    done = make(pairs)
    assert done.returncode != 0
    assert "right/frame_0002.png: is" in done.stderr
    assert "rollcli estimate" not in done.stdout
    assert (pairs / "rolls.csv").read_bytes() == before
    assert make(pairs).returncode != 0


@pytest.mark.slow
def test_its_makefile_stops_at_a_map_without_an_angle(pairs):
    (pairs / "maps" / "frame_0001.png").write_bytes(b"no map")
    for _ in range(2):
        done = make(pairs)
        assert done.returncode != 0
        assert "maps/frame_0001.png: is" in done.stderr
        assert "rollcli report" not in done.stdout
        assert not (pairs / "rolls.csv").exists()


@pytest.mark.slow
def test_its_makefile_leaves_out_the_map_of_a_pair_that_is_gone(pairs):
    for side in ("left", "right"):
        (pairs / side / "frame_0002.png").unlink()
    touch(pairs / "left" / "frame_0001.png")
    assert make(pairs).returncode == 0
    files = [line.split(",")[0] for line in (pairs / "rolls.csv").read_text().splitlines()[1:]]
    assert files == ["maps/frame_0001.png", "maps/frame_0003.png"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_there_for_each_shell_it_names(tmp_path, shell):
    assert f"_ROLLCLI_COMPLETE={shell}_source rollcli" in OPTIONS_PAGE.read_text("utf-8")
    if shell == "bash" and shutil.which("bash") is None:
        pytest.skip("bash, which is asked for its version, is not installed")
    script = rollcli(cwd=tmp_path, _ROLLCLI_COMPLETE=f"{shell}_source", status=0)
    assert f"_ROLLCLI_COMPLETE={shell}_complete" in script.out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("rollcli e", {"estimate", "evaluate"}),
        ("rollcli estimate --me", {"--method"}),
        ("rollcli estimate --method g", {"gd", "gss"}),
        ("rollcli derotate --fr", {"--from"}),
        ("rollcli evaluate ", {"accuracy", "paper"}),
        ("rollcli unknown es", {"estimate"}),
    ],
)
def test_commands_options_and_choices_complete(tmp_path, words, expected):
    position = str(words.count(" "))
    variables = {"_ROLLCLI_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": position}
    done = rollcli(cwd=tmp_path, **variables)
    assert {line.partition(",")[2] for line in done.out.splitlines()} == expected
    assert done.err == ""  # it would be in the middle of what is typed
