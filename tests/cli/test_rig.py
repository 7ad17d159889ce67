"""`rollcli rig` as a user runs it."""

import json
import re
import shutil

import numpy as np
import pytest

from rollcli.files.results import Row, format_header, format_row
from tests.rig.drive.series import drive
from tests.run_cli import rollcli

JUMP = {"seed": 1, "frames": 3000, "sd": 0.1, "jump": 0.8, "at": 1500}
STABLE = {"seed": 2, "frames": 1000, "sd": 0.1}


def rows(values, errors, *, folder="maps/", suspect=(), failed=(), method="gd"):
    made = []
    for place, (value, error) in enumerate(zip(values, errors, strict=True)):
        name = f"{folder}frame_{place}.png"
        if place in failed:
            made.append(Row(name, message=f"{name}: is empty"))
        else:
            status = "suspect" if place in suspect else "ok"
            made.append(Row(name, "", status, float(value), 1.96 * float(error), method=method))
    return made


def write(path, given, form="csv", run=None):
    path.write_bytes(b"".join([format_header(form), *(format_row(row, form) for row in given)]))
    if run is not None:
        path.with_name(f"{path.name}.run.json").write_text(json.dumps(run))


def record(shard="1/1", frames=None, encoding=("kitti",), **options):
    run = {"rollcli": "0", "options": {"method": "gd", "shard": shard, **options}, "encoding": list(encoding)}
    return run | ({} if frames is None else {"inputs": {"frames": frames}})


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Two results that nobody changes."""
    folder = tmp_path_factory.mktemp("written")
    write(folder / "jump.csv", rows(*drive(**JUMP), suspect={3, 4}, failed={10}))
    write(folder / "stable.csv", rows(*drive(**STABLE)))
    return folder


@pytest.fixture
def folder(written, tmp_path):
    """The same results, and nothing else."""
    for path in written.iterdir():
        shutil.copyfile(path, tmp_path / path.name)
    return tmp_path


def rig(folder, *arguments):
    return rollcli("rig", *arguments, cwd=folder)


GATES = [
    ["--expect-roll", "0", "--within", "90"],
    ["--expect-pitch", "0", "--within", "90"],
    ["--expect-height", "1", "--within-height", "9"],
    ["--max-drift", "90"],
    ["--max-jump", "90"],
]


@pytest.mark.parametrize("gate", GATES, ids=lambda gate: gate[0])
@pytest.mark.parametrize("kind", ["one row", "a few rows", "all suspect", "all failed"])
def test_a_gate_never_passes_for_want_of_data(tmp_path, gate, kind):
    count = {"one row": 1, "a few rows": 6}.get(kind, 40)
    every = set(range(count))
    given = rows(
        np.full(count, 0.1),
        np.full(count, 0.05),
        suspect=every if kind == "all suspect" else (),
        failed=every if kind == "all failed" else (),
    )
    write(tmp_path / "few.csv", given)
    done = rig(tmp_path, "few.csv", *gate)
    assert done.status == 5
    assert done.err.count("\n") == 1
    alone = rig(tmp_path, "few.csv")
    assert alone.status == 0
    assert "jumps   none" not in alone.out
    assert ("jumps   too few frames to tell" in alone.out) == (kind in ("one row", "a few rows"))


HEADER = format_header("csv").decode()


def shards(folder, given, count, **options):
    for index in range(1, count + 1):
        part = given[index - 1 :: count]
        write(folder / f"part{index}.csv", part, run=record(f"{index}/{count}", len(part), **options))
    return [f"part{index}.csv" for index in range(1, count + 1)]


def test_shards_in_any_order_are_the_whole_run_with_and_without_their_records(folder):
    names = shards(folder, rows(*drive(**JUMP), suspect={3, 4}, failed={10}), 3)
    expected = rig(folder, "jump.csv").out
    assert rig(folder, *names).out == expected
    assert rig(folder, *reversed(names)).out == expected
    for name in names:  # which are put together by their frames, then
        (folder / f"{name}.run.json").unlink()
    assert rig(folder, *reversed(names)).out == expected


def test_drives_are_told_apart_and_the_one_that_differs_is_named(tmp_path):
    first = rows(*drive(1, 1500, sd=0.1), folder="monday/")
    second = rows(*drive(2, 1500, sd=0.1, level=0.4), folder="tuesday/")
    write(tmp_path / "two.csv", first + second)
    out = rig(tmp_path, "two.csv").out
    assert re.match(r"roll +\+0\.\d+ ± 0\.\d+° in tuesday  \(3,000 of 3,000 frames\)\n", out)
    assert re.search(r"\ndrift .*° over tuesday: none is seen\njumps +none\n", out)
    assert "tuesday differs from monday by +0." in out
    segments = [line for line in out.splitlines() if "_1499.png" in line]
    by_drive = {line.rpartition(", ")[0].split()[-1]: line for line in segments}
    assert by_drive.keys() == {"monday/frame_0.png", "tuesday/frame_0.png"}
    assert by_drive["monday/frame_0.png"].endswith("monday/frame_1499.png")
    assert by_drive["tuesday/frame_0.png"].endswith("tuesday/frame_1499.png  differs")
    values = json.loads(rig(tmp_path, "two.csv", "--format", "json").out)
    assert [(each["drive"], each["first"], each["last"]) for each in values["segments"]] == [
        ("monday", 0, 1499),
        ("tuesday", 1500, 2999),
    ]
    assert rig(tmp_path, "two.csv", "--expect-roll", "0.4", "--within", "0.2").status == 4


def test_a_result_in_parts_is_read_as_one_file_is(folder):
    given = rows(*drive(**STABLE))
    (folder / "parts").mkdir()
    write(folder / "parts" / "part-00000.jsonl", given[:600], "jsonl")
    write(folder / "parts" / "part-00001.jsonl", given[600:], "jsonl")
    assert rig(folder, "parts").out == rig(folder, "stable.csv").out
