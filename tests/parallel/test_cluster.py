"""A real Dask scheduler and two real workers, on this machine."""

import json
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.in_process import run_here
from tests.object_store import joined, upload
from tests.run_cli import command, contents, environment, road_map, rollcli, write_maps, write_pair

pytest.importorskip("distributed", reason="the extra cluster is not installed")

from rollcli import __version__
from rollcli.errors import ClusterError
from rollcli.files.storage import list_names, read_bytes
from rollcli.parallel import cluster
from rollcli.parallel.cluster import ClusterFuture, _check_workers, probe
from rollcli.parallel.workers import SharedPaths

FRAMES = 60
IMAGES = ("--derotated", "upright", "--vdisparity", "v")


LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
ONE_PROCESS = ("--nthreads", "1", "--no-nanny")


@pytest.fixture
def scheduler_process(tmp_path):
    """A scheduler that has no workers yet, and its address."""
    state = tmp_path / "scheduler.json"
    process = dask("scheduler", tmp_path, *LOCAL, "--port", "0", "--scheduler-file", state)
    try:
        wait_for(lambda: state.exists() and state.read_text().endswith("}"))
        yield process, json.loads(state.read_text())["address"]
    finally:
        end(process)


@pytest.fixture
def scheduler(scheduler_process):
    """The address of the scheduler."""
    return scheduler_process[1]


@pytest.fixture
def workers(tmp_path, scheduler):
    """Two worker processes, each in a folder of its own."""
    processes = []
    try:
        for name in ("one", "two"):
            (tmp_path / name).mkdir()
            processes.append(
                dask("worker", tmp_path / name, scheduler, *LOCAL, "--nthreads", "1", "--no-nanny")
            )
        yield processes
    finally:
        for process in processes:
            end(process)


def end(process):
    process.kill()
    process.wait()


def dask(kind, folder, *arguments):
    """A Dask process that works in a folder of its own, as on another machine."""
    with (folder / f"{kind}.log").open("wb") as log:
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, arguments)],
            cwd=folder,
            env=environment(),
            stdout=log,
            stderr=subprocess.STDOUT,
        )


def wait_for(condition):
    give_up = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < give_up
        time.sleep(0.02)
    return found


def test_a_cluster_that_loses_a_worker_gives_the_bytes_of_a_local_run(tmp_path, scheduler, workers):
    local, far = tmp_path / "local", tmp_path / "far"
    for folder in (local, far):
        write_maps(folder / "maps", FRAMES, width=300, height=200)
        (folder / "maps" / "frame5.png").write_bytes(b"")
    assert rollcli("estimate", "maps", "-o", "rolls.csv", *IMAGES, cwd=local).status == 3
    line = command("estimate", "maps", "-o", "rolls.csv", *IMAGES, "--scheduler", scheduler)
    run = subprocess.Popen(line, cwd=far, env=environment(), stderr=subprocess.PIPE, text=True)
    result = far / "rolls.csv"
    wait_for(lambda: run.poll() is not None or (result.exists() and result.read_bytes().count(b"\n") > 8))
    workers[0].kill()
    _, err = run.communicate(timeout=120)
    assert run.returncode == 3, err
    assert result.read_bytes().count(b"\n") == FRAMES + 1
    record = "rolls.csv.run.json"  # holds the times of the inputs, which differ
    assert differing(contents(local), contents(far)) <= {record}
    counts = [json.loads((folder / record).read_text())["counts"] for folder in (local, far)]
    assert counts[0] == counts[1]


def test_conversions_on_a_cluster_give_the_bytes_of_a_local_run(tmp_path, scheduler, workers):
    write_maps(tmp_path / "maps", 3)
    write_pair(tmp_path, "a.png", road_map(width=160, height=80) / 2)
    (tmp_path / "maps" / "frame1.png").write_bytes(b"no map")
    lines = {
        "derotate": ("maps", "--roll", "2"),
        "vdisparity": ("maps", "--counts"),
        "disparity": ("--left", "left", "--right", "right", "--num-disparities", "32"),
    }
    for name, arguments in lines.items():
        status = 0 if name == "disparity" else 3
        assert rollcli(name, *arguments, "-o", f"here/{name}", cwd=tmp_path).status == status
        far = rollcli(name, *arguments, "-o", f"far/{name}", "--scheduler", scheduler, cwd=tmp_path)
        assert far.status == status, far.err
    assert contents(tmp_path / "far") == contents(tmp_path / "here")


def differing(one, other):
    return {name for name in one.keys() | other.keys() if one.get(name) != other.get(name)}


def test_a_scheduler_that_is_lost_ends_the_run_which_goes_on_without_it(tmp_path, scheduler_process, workers):
    process, scheduler = scheduler_process
    write_maps(tmp_path / "maps", 100, width=300, height=200)
    arguments = ("estimate", "maps", "-q", "-o", "rolls.csv", *IMAGES)
    line = command(*arguments, "--scheduler", scheduler)
    run = subprocess.Popen(line, cwd=tmp_path, env=environment(), stderr=subprocess.PIPE, text=True)
    result = tmp_path / "rolls.csv"
    wait_for(lambda: run.poll() is not None or (result.exists() and result.read_bytes().count(b"\n") > 8))
    process.kill()
    _, err = run.communicate(timeout=60)
    assert run.returncode == 1
    assert err.startswith(f"rollcli: {scheduler}: the connection to the scheduler is lost; ")
    assert err.endswith(" rows are kept, continue with --resume\n")
    assert rollcli(*arguments, "--resume", cwd=tmp_path).status == 0
    assert result.read_bytes().count(b"\n") == 101
    assert not list(tmp_path.rglob("*.part"))


def test_nobody_waits_for_what_was_sent_while_the_connection_broke(monkeypatch):
    monkeypatch.setattr(cluster, "_POLL_S", 0.01)
    client = SimpleNamespace(status="closed")
    with pytest.raises(ClusterError, match="the connection to the scheduler is lost"):
        ClusterFuture(Future(), client, "tcp://far:8786").result()


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("does not see a.png", "worker tcp://second:1: does not see a.png"),
        (ImportError("no module"), "worker tcp://second:1: cannot run rollcli .*: no module"),
    ],
)
def test_a_run_with_a_worker_that_cannot_take_part_is_refused_and_leaves_no_mark(tmp_path, answer, said):
    def ask(function, version, sizes, marks, on_error):
        assert [Path(mark).exists() for mark in marks] == [True]
        return {"tcp://first:1": "", "tcp://second:1": answer}

    with pytest.raises(ClusterError, match=said):
        _check_workers(SimpleNamespace(run=ask), SharedPaths((), (str(tmp_path / "up"),)))
    assert list((tmp_path / "up").iterdir()) == []


def test_a_worker_that_has_no_such_program_or_files_is_named(tmp_path):
    there = tmp_path / "a.png"
    there.write_bytes(b"123")
    assert probe(__version__, {str(there): 3}, [str(tmp_path / "a.png")]) == ""
    assert "this is 0.0" in probe("0.0", {}, [])
    assert f"does not see {tmp_path / 'b.png'}" in probe(__version__, {str(tmp_path / "b.png"): 3}, [])
    assert "does not see" in probe(__version__, {str(there): 4}, [])
    assert "image folders must lie on storage" in probe(__version__, {}, [str(tmp_path / "v" / "mark")])


def estimate_here(address, cwd, *more):
    """Run in this process, whose patience with clusters a test can set."""
    line = ("estimate", "maps", "-o", "rolls.csv", "--scheduler", address, *more)
    return run_here(line, cwd, "", environment())


def test_a_scheduler_that_does_not_answer_ends_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECT_S", 0.5)
    write_maps(tmp_path / "maps", 2)
    done = estimate_here("tcp://127.0.0.1:9", tmp_path)
    assert done.status == 1
    assert "tcp://127.0.0.1:9: no Dask scheduler answers there" in done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize("greeting", [b"", b"HTTP/1.1 400 Bad Request\r\nServer: x\r\n\r\n"])
def test_a_server_that_is_no_scheduler_ends_the_run(tmp_path, monkeypatch, greeting):
    monkeypatch.setattr(cluster, "_CONNECT_S", 0.5)
    monkeypatch.setattr(cluster, "_GREETING_S", 0.0)
    write_maps(tmp_path / "maps", 1)
    with socket.create_server(("127.0.0.1", 0)) as server:
        answering = threading.Thread(target=greet, args=(server, greeting), daemon=True)
        answering.start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        done = estimate_here(address, tmp_path)
    assert (done.status, done.err) == (1, f"rollcli: {address}: no Dask scheduler answers there\n")


def greet(server, greeting):
    """Say something to whoever comes, and wait until he goes."""
    caller, _ = server.accept()
    with caller:
        caller.sendall(greeting)
        while caller.recv(1000):
            pass


@pytest.mark.parametrize("address", ["", "node0", "http://node0:8786", "tcp://node0:x", "tls://node0:8786"])
def test_what_is_no_address_is_refused_and_the_result_that_is_there_is_kept(tmp_path, address):
    write_maps(tmp_path / "maps", 1)
    rollcli("estimate", "maps", "-o", "rolls.csv", cwd=tmp_path)
    before = contents(tmp_path)
    done = estimate_here(address, tmp_path, "--overwrite")
    assert done.status == 2
    assert done.err.startswith(f"rollcli: --scheduler {address!r}: ")
    assert done.err.endswith("; an address looks like tcp://host:8786\n")
    assert contents(tmp_path) == before


def test_a_scheduler_without_workers_ends_the_run(tmp_path, monkeypatch, scheduler):
    monkeypatch.setattr(cluster, "_FIRST_WORKER_S", 0.5)
    write_maps(tmp_path / "maps", 2)
    done = estimate_here(scheduler, tmp_path)
    assert done.status == 1
    assert f"{scheduler}: has no workers" in done.err
    assert rollcli("estimate", "maps", "-o", "rolls.csv", cwd=tmp_path).status == 0


# the bucket comes first: workers take its settings over when they start
def test_workers_that_share_only_a_bucket_give_the_bytes_of_a_local_run(bucket, tmp_path, scheduler, workers):
    write_maps(tmp_path / "maps", FRAMES, width=300, height=200)
    upload(tmp_path / "maps", f"{bucket}/maps")
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "--derotated", "up", cwd=tmp_path).status == 0

    line = ("estimate", f"{bucket}/maps/", "-o", f"{bucket}/rolls.csv", "--derotated", f"{bucket}/up")
    line = (*line, "--part-rows", "8", "--scheduler", scheduler)
    (tmp_path / "driver").mkdir()
    run = subprocess.Popen(command(*line), cwd=tmp_path / "driver", env=environment())
    wait_for(lambda: run.poll() is not None or len(list_names(f"{bucket}/rolls.csv")) > 1)
    run.kill()
    assert run.wait() != 0
    resumed = subprocess.Popen(command(*line, "--resume", "-q"), cwd=tmp_path / "driver", env=environment())
    wait_for(lambda: resumed.poll() is not None or len(list_names(f"{bucket}/rolls.csv")) > 3)
    workers[0].kill()
    assert resumed.wait(timeout=120) == 0

    expected = (tmp_path / "rolls.csv").read_bytes().replace(b"maps/", f"{bucket}/maps/".encode())
    assert joined(f"{bucket}/rolls.csv") == expected
    images = {name: read_bytes(f"{bucket}/up/{name}") for name in list_names(f"{bucket}/up")}
    assert images == contents(tmp_path / "up")
