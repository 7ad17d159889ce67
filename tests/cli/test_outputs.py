"""The images that `estimate` writes: their names, what they never replace, and the later of two runs."""

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


@pytest.mark.parametrize("line", LATE)
def test_the_later_of_two_does_not_replace_what_the_first_wrote(inputs, monkeypatch, line):
    check, written = outputs.check_writes, inputs / LATE[line]

    def checked_then_written_by_another(*arguments, **settings):
        check(*arguments, **settings)
        written.parent.mkdir(exist_ok=True)
        written.write_bytes(b"another's")

    monkeypatch.setattr(outputs, "check_writes", checked_then_written_by_another)
    done = rollcli(*line.split(), cwd=inputs, status=2)
    assert f"{LATE[line]}: exists already; give --overwrite to replace it" in done.err
    assert written.read_bytes() == b"another's"
    assert rollcli(*line.split(), "--overwrite", cwd=inputs).status == 0
    assert written.read_bytes() != b"another's"


@pytest.mark.parametrize("several", mostly_slow([2, 3], 2))
def test_any_number_of_workers_gives_the_same_bytes(tmp_path, several):
    write_maps(tmp_path / "maps", 12)
    for jobs in (1, several):
        images = ["--derotated", f"d{jobs}", "--vdisparity", f"v{jobs}", "--road-mask", f"r{jobs}"]
        rollcli("estimate", "maps", "-j", str(jobs), "-o", f"{jobs}.csv", *images, cwd=tmp_path)
    assert (tmp_path / f"{several}.csv").read_bytes() == (tmp_path / "1.csv").read_bytes()
    for kind in "dvr":
        assert contents(tmp_path / f"{kind}{several}") == contents(tmp_path / f"{kind}1")
