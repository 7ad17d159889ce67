"""Options that have no effect on a run are told, and truly have none."""

import shlex

import numpy as np
import pytest

from tests.run_cli import road_map, rollcli, write_kitti, write_pair


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("idle")
    for name in ("a", "b"):
        write_kitti(folder / "maps" / f"{name}.png", road_map(0.02))
    np.save(folder / "kitti.npy", road_map(0.02))
    for name in ("1.png", "2.png"):
        write_pair(folder, name, road_map(0.05, width=320, height=160) / 2)
    return folder


@pytest.fixture
def run(folder):
    """Run a command line; return its status, its rows and what it tells of idle options."""

    def run(*words, **variables):
        done = rollcli(*words, cwd=folder, **variables)
        return done.status, done.out, [line for line in done.err.splitlines() if "no effect here" in line]

    return run


PAIRS = "estimate --left left --right right"


@pytest.mark.parametrize(
    ("line", "idle", "reason"),
    [
        ("estimate maps", "--sgbm-mode hh", "the inputs are maps, which are not matched"),
        ("estimate maps", "--num-disparities 64", "the inputs are maps, which are not matched"),
        ("estimate maps", "--align off", "the inputs are maps, which are not matched"),
        ("estimate maps", "--match order", "the inputs are maps, which are not matched"),
        ("estimate maps", "--downscale 2", "the inputs are maps, which are not matched"),
        ("estimate maps", "--save-as npy", "a map keeps the format of its input"),
        ("estimate maps --road all", "--max-roll 1", "--road all looks for no road"),
        ("estimate maps --road all --method plane", "--max-roll 1", "--road all looks for no road"),
        ("estimate maps --road all", "--seed 7", "--road all draws no samples"),
        ("estimate maps --road all --method plane", "--model line", "--method plane fits planes"),
        ("estimate maps --road all --method areas", "--model line", "--method areas fits planes"),
        ("estimate maps --method gss", "--lambda0 3", "only --method gd has a learning rate"),
        ("estimate maps --method plane", "--tolerance 1", "--method plane does not iterate on the angle"),
        ("estimate maps --method areas", "--tolerance 1", "--method areas does not iterate on the angle"),
        ("estimate maps", "--part-rows 1", "only Parquet and results in an object store have parts"),
        ("estimate maps/a.png", "--recursive", "no folder is named"),
        (
            "estimate maps/a.png",
            "--exclude a.png",
            "they choose among the files of folders, and none is named",
        ),
        (PAIRS, "--encoding sgbm", "pairs are matched, and no stored disparities are read"),
        ("estimate maps/a.png", "--heights-range -1:1", "only --heights-preview has colours"),
        (PAIRS, "--scale 3", "pairs are matched, and no stored disparities are read"),
        (PAIRS, "--invalid 3", "pairs are matched, and no stored disparities are read"),
        (PAIRS, "--save-as npy", "only --disparity, --derotated and --heights write maps"),
        (f"{PAIRS} --vertical-offset 0", "--align off", "--vertical-offset says how the right image lies"),
        (f"{PAIRS} --speckle-size 0", "--speckle-range 9", "--speckle-size 0 keeps every patch"),
    ],
)
def test_what_is_told_to_have_no_effect_has_none(run, line, idle, reason):
    status, rows, told = run(*shlex.split(line))
    assert (status, told) == (0, [])
    assert run(*shlex.split(line), *shlex.split(idle)) == (
        status,
        rows,
        [f"rollcli: {idle.split()[0]}: no effect here: {reason}"],
    )


@pytest.mark.parametrize(
    ("line", "idle", "reason"),
    [
        ("derotate maps --roll 2", "--scale 3", "rotated maps keep their stored numbers"),
        ("derotate maps --roll 2", "--encoding px", "rotated maps keep their stored numbers"),
        ("derotate maps/a.png --roll 2", "--recursive", "no folder is named"),
        ("vdisparity maps/a.png", "--recursive", "no folder is named"),
        ("vdisparity maps --focal 100 --principal-point 80,60", "--baseline 0.5", "only --encoding depth"),
        ("disparity --left left --right right --vertical-offset 0", "--align off", "--vertical-offset says"),
    ],
)
def test_conversions_write_the_same_with_and_without(folder, run, tmp_path, line, idle, reason):
    written = []
    for words in ("", idle):
        out = tmp_path / f"out{len(written)}"
        status, _, told = run(*shlex.split(line), *shlex.split(words), "-o", str(out))
        assert status == 0
        assert len(told) == bool(words)
        assert all(reason in each for each in told)
        written.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert written[0] == written[1]


def test_options_of_one_reason_are_told_in_a_line(run):
    told = run("estimate", "maps", "--sgbm-mode", "hh", "--block-size", "7")[2]
    assert told == [
        "rollcli: --block-size, --sgbm-mode: no effect here: the inputs are maps, which are not matched"
    ]


def test_the_environment_and_quiet_runs_are_told_nothing(run):
    assert run("estimate", "maps", ROLLCLI_ESTIMATE_SGBM_MODE="hh")[2] == []
    assert run("estimate", "maps", "--sgbm-mode", "hh", "-q")[2] == []


def test_what_has_an_effect_is_not_told(run):
    assert (
        run("estimate", "maps", "--max-roll", "20", "--seed", "1", "--recursive", "--exclude", "b*")[2] == []
    )
    assert run("estimate", "maps/*.png", "--exclude", "b*", "--road", "all", "--method", "exact")[2] == []
    assert run("estimate", "kitti.npy", "maps", "--recursive", "--exclude", "b*")[2] == []


@pytest.mark.parametrize(
    "line",
    [
        "estimate maps",
        "derotate maps --roll 2 -o out",
        "vdisparity maps -o out",
        "disparity --left left --right right -o out",
    ],
)
def test_a_cluster_has_workers_of_its_own(run, line):
    cluster = (*shlex.split(line), "--dry-run", "--scheduler", "tcp://127.0.0.1:1")
    status, _, told = run(*cluster, "--jobs", "2")
    assert (status, told) == (0, ["rollcli: --jobs: no effect here: --scheduler has workers of its own"])
    assert run(*cluster)[2] == run(*shlex.split(line), "--dry-run", "--jobs", "2")[2] == []
