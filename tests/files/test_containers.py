"""Archives are read as folders; what is in them can neither fill memory nor name a file elsewhere."""

import math
import shutil
import tarfile
import zipfile

import pytest

from rollcli.errors import InputError, UsageError
from rollcli.files.containers import file_of, shown
from rollcli.files.search import Search
from rollcli.files.storage import read_bytes
from tests.run_cli import command, contents, ended, road_map, rollcli, rows_of, write_kitti, write_maps


@pytest.mark.slow
def test_workers_that_were_forked_from_one_process_read_an_archive_each_for_itself(tmp_path):
    for number in range(24):
        write_kitti(tmp_path / "all" / f"{number}.png", road_map(width=640, height=480, seed=number))
    shutil.make_archive(str(tmp_path / "run"), "zip", tmp_path / "all")
    line = ("derotate", "run.zip", "--roll", "2", "-q")
    assert rollcli(*line, "-j", "1", "-o", "one", cwd=tmp_path).status == 0
    done = rollcli(*line, "-j", "6", "-o", "six", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    assert contents(tmp_path / "six") == contents(tmp_path / "one")


@pytest.mark.parametrize("slash", ["/", "\\"])
def test_a_member_cannot_name_a_file_elsewhere(tmp_path, slash):
    write_maps(tmp_path / "maps", 2)
    with zipfile.ZipFile(tmp_path / "bad.zip", "w") as file:
        file.write(tmp_path / "maps/frame0.png", "../../frame0.png".replace("/", slash))
        file.write(tmp_path / "maps/frame1.png", "run/frame1.png".replace("/", slash))
    done = rollcli("estimate", "bad.zip", "--mask", "maps", "--derotated", "in/side", cwd=tmp_path)
    assert (done.status, [row["status"] for row in rows_of(done.out)]) == (3, ["error", "ok"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.zip", "in", "maps"]
    assert [*contents(tmp_path / "in")] == ["side/run/frame1.png"]


def test_members_that_would_fill_memory_and_packed_archives_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.npy", bytes(40 * 2**20))
        file.writestr("b.npy", b"fine")
    with pytest.raises(InputError, match=r"bomb\.zip#a\.npy: has 41943040 bytes; up to 32 MB"):
        read_bytes(tmp_path / "bomb.zip#a.npy")
    assert read_bytes(tmp_path / "bomb.zip#b.npy") == b"fine"
    with pytest.raises(UsageError, match="no input found in this archive"):
        list(Search((".png",)).files(str(tmp_path / "bomb.zip")))
    with pytest.raises(UsageError, match=r"unpack it, or pack it as \.zip or \.tar"):
        Search((".png",)).files("run.tar.gz")


def test_a_file_may_have_a_number_sign_in_its_name(tmp_path):
    path = tmp_path / "a.zip#b.png"
    path.write_bytes(b"itself")
    assert (read_bytes(path), file_of(str(path))) == (b"itself", str(path))
    assert shown("run.tar#a.png#@512+9") == "run.tar#a.png"


@pytest.mark.parametrize("given", [["-"], ["--files-from", "maps/frame0.png"]])
def test_an_image_in_place_of_a_list_is_told_what_a_list_is(tmp_path, given):
    write_maps(tmp_path / "maps", 1)
    data = (tmp_path / "maps/frame0.png").read_bytes()
    done = ended(command("estimate", *given), tmp_path, input=data, text=False)
    said = f"rollcli: {given[-1]}: stands for a list of files, one a line".encode()
    assert (done.returncode, done.stderr.startswith(said)) == (2, True)


def test_a_tar_gives_what_unpacking_it_would(tmp_path):
    with tarfile.open(tmp_path / "x.tar", "w") as file:
        for number in range(2):
            write_kitti(tmp_path / f"{number}.png", road_map(0.1 * number))
            file.add(tmp_path / f"{number}.png", "a.png")
        for name, target in {"b.png": "a.png", "c.png": "a.png", "d.png": "c.png"}.items():
            link = tarfile.TarInfo(name)
            link.type = tarfile.LNKTYPE if name == "b.png" else tarfile.SYMTYPE
            link.linkname = target
            file.addfile(link)
    (tmp_path / "y.tar").write_bytes((tmp_path / "x.tar").read_bytes()[:100])
    *found, damaged = rows_of(rollcli("estimate", "*.tar", "--mask", "x.tar", cwd=tmp_path).out)
    assert (damaged["file"], damaged["message"]) == ("y.tar", "is a damaged archive: truncated header")
    assert [row["file"] for row in found] == [f"x.tar#{name}.png" for name in "abcd"]
    assert {row["roll_deg"] for row in found} == {found[0]["roll_deg"]}
    assert float(found[0]["roll_deg"]) == pytest.approx(math.degrees(0.1), abs=0.05)
