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


def test_the_table_begins_with_the_answer_and_names_the_frame_of_a_jump(folder):
    done = rig(folder, "jump.csv")
    assert done.status == 0
    first, *rest = done.out.splitlines()
    assert first.startswith("roll    +0.")
    assert re.search(
        r"± 0\.\d+° since maps/frame_1[45]\d\d\.png, where it jumped by \+0\.\d+ ± 0\.\d+°  \(", first
    )
    assert " of 3,000 frames, 2 suspect, 1 failed" in first
    (sentence,) = (line for line in rest if line.startswith("        +0."))
    assert "° at maps/frame_" in sentence
    assert abs(int(sentence.partition("frame_")[2].removesuffix(".png")) - 1500) <= 15
    assert done.err == ""


def test_a_result_that_is_read_is_never_replaced(folder):
    assert rig(folder, "stable.csv", "-o", "stable.csv", "--overwrite").status == 2


def test_json_lines_and_standard_input_are_read_as_csv_is(folder):
    write(folder / "stable.jsonl", rows(*drive(**STABLE)), "jsonl")
    expected = rig(folder, "stable.csv").out
    assert rig(folder, "stable.jsonl").out == expected
    assert rollcli("rig", "-", cwd=folder, stdin=(folder / "stable.csv").read_text()).out == expected


def test_a_gate_that_is_kept_ends_with_0_and_one_that_is_not_with_4(folder):
    kept = ["--expect-roll", "-0.4", "--within", "0.5"]
    kept += ["--max-drift", "1", "--max-jump", "0.2", "--min-ok", "1"]
    assert rig(folder, "stable.csv", *kept).status == 0
    done = rig(folder, "jump.csv", *kept)
    assert done.status == 4
    said = done.err.splitlines()
    assert len(said) == 3
    assert "the roll of maps/frame_" in said[0]
    assert "more than 0.5° from -0.4°" in said[0]
    assert "the jump at maps/frame_" in said[1]
    assert "2,997 of 3,000 frames are ok, 99.9 %, fewer than 100 %; " in said[2]
    assert "not: maps/frame_3.png, maps/frame_4.png, maps/frame_10.png" in said[2]
    few = rig(folder, "jump.csv", "--min-ok", "0.9995")
    assert (few.status, "99.9 %, fewer than 99.95 %; " in few.err) == (4, True)
    checks = json.loads(rig(folder, "jump.csv", *kept, "--format", "json").out)["checks"]
    assert [(each["name"], each["ok"]) for each in checks] == [
        ("expect-roll", False),
        ("max-drift", True),
        ("max-jump", False),
        ("min-ok", False),
    ]


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


def test_all_suspect_frames_say_so_and_can_be_counted(tmp_path):
    values = np.random.default_rng(0).normal(0.3, 0.1, 60)
    write(tmp_path / "s.csv", rows(values, np.full(60, 0.05), suspect=set(range(60))))
    done = rig(tmp_path, "s.csv")
    assert done.out.startswith("roll    unknown  (0 of 60 frames, 60 suspect)")
    assert "no interval for the roll: no frame counts" in done.out
    assert rig(tmp_path, "s.csv", "--include-suspect").out.startswith("roll    +0.3")


HEADER = format_header("csv").decode()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "is not a result of rollcli estimate"),
        (HEADER, "has no rows"),
        ('{"file": "a", "status": "ok", "roll_deg": [1]}\n', "line 1: [1] is no value for roll_deg"),
        ("file,status,roll_deg,method\na,ok,1,gd\nb,ok,1,plane\n", "rows of the methods gd, plane"),
    ],
)
def test_what_is_no_result_is_one_line_and_status_2(tmp_path, content, reason):
    (tmp_path / "r.csv").write_text(content)
    assert reason in rig(tmp_path, "r.csv").refused()


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


@pytest.mark.parametrize(
    ("chosen", "reason"),
    [
        ([0, 2], "is one of 3 shards; missing: 2/3"),
        ([1], "is one of 3 shards; missing: 1/3, 3/3"),
        ([0, 1, 2, "copy.csv"], "rollcli: part1.csv, copy.csv: are both shard 1/3"),
        ([0, "stable.csv"], "there is no stable.csv.run.json to say which shard it is"),
        ([0, "whole.csv"], "are not shards of one run"),
        ([0, 1, "other.csv"], "are not shards of one run: --method was gd and plane"),
        ([0, 1, "later.csv"], "are not shards of one run: the version of rollcli was 0 and 1"),
    ],
)
def test_results_that_are_not_all_shards_of_one_run_are_refused(folder, chosen, reason):
    given = rows(*drive(**STABLE))
    names = shards(folder, given, 3)
    write(folder / "copy.csv", given[::3], run=record("1/3"))
    write(folder / "whole.csv", given, run=record("1/1"))
    write(folder / "other.csv", given[2::3], run=record("3/3", method="plane"))
    write(folder / "later.csv", given[2::3], run=record("3/3") | {"rollcli": "1"})
    refusal = rig(folder, *(names[each] if isinstance(each, int) else each for each in chosen)).refused()
    assert reason in refusal


def test_what_cannot_be_put_together_is_refused(folder):
    names = shards(folder, rows(*drive(**STABLE)), 2)
    (folder / "odd.csv").write_bytes((folder / names[0]).read_bytes())
    (folder / "odd.csv.run.json").write_text(json.dumps(record("3/2")))
    told = rig(folder, "odd.csv", names[1]).refused()
    assert told == "rollcli: odd.csv.run.json: is not the record of a run: its shard is no I/N\n"
    for name in ("odd.csv", names[0]):
        (folder / f"{name}.run.json").unlink()
    refusal = rig(folder, "odd.csv", names[0]).refused()
    assert "odd.csv and part1.csv both have a row of maps/frame_0.png" in refusal


def test_a_run_that_has_not_ended_is_said_and_passes_no_gate(folder):
    write(folder / "half.csv", rows(*drive(**STABLE)), run=record(frames=2000))
    done = rig(folder, "half.csv")
    assert done.status == 0
    assert done.err == "rollcli: half.csv: holds 1,000 of 2,000 frames: its run has not ended\n"
    assert rig(folder, "half.csv", "--min-ok", "0.5").status == 5


def test_maps_of_several_encodings_are_said(folder):
    write(folder / "mixed.csv", rows(*drive(**STABLE)), run=record(encoding=["kitti", "px"]))
    done = rig(folder, "mixed.csv")
    assert done.status == 0
    assert done.err == "rollcli: mixed.csv: maps were read as kitti, px: are they one rig's?\n"


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


def test_against_says_how_far_the_rig_has_moved(tmp_path):
    for name, seed, level in (("before", 1, -0.44), ("same", 2, -0.44), ("after", 3, 0.4)):
        write(tmp_path / f"{name}.csv", rows(*drive(seed, 1500, sd=0.1, level=level)))
    still = rig(tmp_path, "before.csv", "--against", "same.csv", "--max-jump", "0.3")
    assert still.status == 0
    assert "no move is seen" in still.out
    moved = rig(tmp_path, "before.csv", "--against", "after.csv", "--max-jump", "0.3", "--format", "json")
    assert moved.status == 4
    values = json.loads(moved.out)["against"]
    assert values["roll_moved"] is True
    assert values["roll_change_deg"] == pytest.approx(0.84, abs=0.15)
    assert 0 < values["roll_change_ci95_deg"] < 0.2


def test_a_result_in_parts_is_read_as_one_file_is(folder):
    given = rows(*drive(**STABLE))
    (folder / "parts").mkdir()
    write(folder / "parts" / "part-00000.jsonl", given[:600], "jsonl")
    write(folder / "parts" / "part-00001.jsonl", given[600:], "jsonl")
    assert rig(folder, "parts").out == rig(folder, "stable.csv").out
