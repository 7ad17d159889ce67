"""The images that `estimate` writes: their names, what they never replace, and the later of two runs."""

import shutil

import pytest

from rollcli.run import outputs
from tests.report.results import row, write_result
from tests.run_cli import contents, road_map, rollcli, write_kitti, write_maps
from tests.slow import mostly_slow

FRAMES = 2


def test_names_that_differ_in_case_are_one_where_the_folder_ignores_case(tmp_path):
    write_kitti(tmp_path / "one" / "a.png", road_map())
    write_kitti(tmp_path / "two" / "A.png", road_map())
    arguments = ("one/a.png", "two/A.png", "--derotated", "out", "--overwrite")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "Name").touch()
    assert rollcli("estimate", *arguments, cwd=tmp_path).status == 0
    # two names of one file: that is how a folder that ignores case looks
    (tmp_path / "out" / "nAME").hardlink_to(tmp_path / "out" / "Name")
    for path in (tmp_path / "out").glob("?.png"):
        path.unlink()
    before = contents(tmp_path)
    refusal = rollcli("estimate", *arguments, cwd=tmp_path).refused()
    assert "one/a.png and two/A.png would both write" in refusal
    assert contents(tmp_path) == before


# commands that look, work and write, and the last of what each writes
LATE = {
    "rig rolls.csv --against before.csv -o out.txt": "out.txt",
    "report rolls.csv -o out.html --gallery 0": "out.html",
    "report rolls.csv --svg s": "s/histogram.svg",
    "evaluate accuracy rolls.csv --truth truth.csv -o out.txt": "out.txt",
    "evaluate paper maps -o p --turns=-2:2:2 --timed 1 -j1": "p/paper.html",
}


@pytest.fixture
def inputs(maps):
    """Maps, two results and known angles."""
    for name in ("rolls.csv", "before.csv"):
        write_result(maps / name, [row(f"maps/frame{number}.png") for number in range(FRAMES)])
    (maps / "truth.csv").write_text("file,roll_deg\nframe0.png,1\nframe1.png,1\n")
    return maps


@pytest.mark.parametrize("line", mostly_slow(LATE, *list(LATE)[:-1]))  # the paper takes seconds
def test_the_later_of_two_does_not_replace_what_the_first_wrote(inputs, monkeypatch, line):
    check, written = outputs.check_nothing_is_there, inputs / LATE[line]

    def checked_then_written_by_another(*arguments, **settings):
        check(*arguments, **settings)
        written.parent.mkdir(exist_ok=True)
        written.write_bytes(b"another's")

    monkeypatch.setattr(outputs, "check_nothing_is_there", checked_then_written_by_another)
    done = rollcli(*line.split(), cwd=inputs, status=2)
    assert f"{LATE[line]}: exists already; give --overwrite to replace it" in done.err
    assert written.read_bytes() == b"another's"
    assert rollcli(*line.split(), "--overwrite", cwd=inputs).status == 0
    assert written.read_bytes() != b"another's"


# commands that workers share in, how many, and the last of what each writes
SHARED = [
    ("estimate maps -o rolls.csv --derotated d --vdisparity v --road-mask r", "2", "r/frame11.png"),
    ("estimate maps -o rolls.csv --derotated d --vdisparity v --road-mask r", "3", "r/frame11.png"),
    ("derotate maps --from given.csv -o out", "2", "out/frame11.png"),
    *(
        (f"vdisparity maps/frame1*.png --figure {kind} -o v", "2", f"v/frame11.{kind}")
        for kind in ("pdf", "png", "svg")
    ),
    ("report given.csv -o page.html", "2", "page.html"),
]


@pytest.mark.parametrize(("line", "several", "written"), mostly_slow(SHARED, SHARED[0]))
def test_any_number_of_workers_gives_the_same_bytes(tmp_path, line, several, written):
    one, other = tmp_path / "one", tmp_path / "other"
    write_maps(one / "maps", 12)
    rollcli("estimate", "maps", "-o", "given.csv", cwd=one, status=0)
    shutil.copytree(one, other)
    rollcli(*line.split(), "-j", "1", cwd=one, status=0)
    rollcli(*line.split(), "-j", several, cwd=other, status=0)
    assert written in contents(one)
    assert contents(one) == contents(other)
