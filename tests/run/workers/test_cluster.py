"""A real Dask scheduler and two real workers, on this machine."""

import json
import os
import shlex
import shutil
import socket
import subprocess
import sys
import threading
from importlib.util import find_spec
from itertools import count
from unittest.mock import Mock

import pytest

from rollcli import __version__
from rollcli.errors import UsageError, WorkerError
from rollcli.files.results import ALIGNMENT_COLUMNS
from rollcli.files.storage import list_names
from rollcli.run.workers import cluster
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.cluster import check_scheduler, probe, scheduler_address
from tests.in_process import run_here
from tests.object_store import joined, objects_below, upload
from tests.run_cli import (
    contents,
    environment,
    error_of,
    estimated,
    road_map,
    rollcli,
    started,
    wait_for_files,
    wait_until,
    write_maps,
    write_pair,
)

# Dask loads in the tests that use it: it takes a second
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("distributed") is None, reason="the extra cluster is not installed"),
]
FRAMES = 40
IMAGES = ("--derotated", "upright", "--vdisparity", "v")
LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
ONE_PROCESS = ("--nthreads", "1", "--no-nanny")


class Cluster:
    """A scheduler and workers that several tests use; what a test kills is started anew for the next one."""

    def __init__(self, folder, *network, **variables):
        self.folder, self.network, self.variables, self.starts = folder, network, variables, count()
        self.process, self.address, self.processes, self.store = None, "", [], {}

    def scheduler(self):
        """The address of a scheduler that lives."""
        if self.process is None or self.process.poll() is not None:
            self.end()
            state = self.folder / f"scheduler{next(self.starts)}.json"
            self.process = self.dask("scheduler", self.folder, "--port", "0", "--scheduler-file", state)
            wait_until(lambda: state.exists() and state.read_text().endswith("}"))
            self.address = json.loads(state.read_text())["address"]
        return self.address

    def workers(self):
        """Two live worker processes, each in a folder of its own, which may use the store of a test."""
        address = self.scheduler()
        store = {name: value for name, value in environment().items() if name.startswith("AWS_")}
        if self.store != store:
            self.end_workers()
        self.store = store
        self.processes = [each for each in self.processes if each.poll() is None]
        while len(self.processes) < 2:
            folder = self.folder / f"worker{next(self.starts)}"
            folder.mkdir()
            self.processes.append(self.dask("worker", folder, address, *ONE_PROCESS))
        return self.processes

    def dask(self, kind, folder, *arguments):
        """A Dask process that works in a folder of its own, as on another machine."""
        line = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments, *LOCAL, *self.network]
        how = {"env": environment(**self.variables), "stderr": subprocess.STDOUT}
        with (folder / f"{kind}.log").open("wb") as log:
            return subprocess.Popen(list(map(str, line)), cwd=folder, stdout=log, **how)

    def end_workers(self):
        while self.processes:
            end(self.processes.pop())

    def end(self):
        self.end_workers()
        if self.process is not None:
            end(self.process)


@pytest.fixture(scope="module")
def cluster_here(tmp_path_factory):
    """Nothing yet: processes start when a test asks for them."""
    cluster_of_tests = Cluster(tmp_path_factory.mktemp("cluster"))
    yield cluster_of_tests
    cluster_of_tests.end()


@pytest.fixture
def scheduler(cluster_here):
    """The address of the scheduler."""
    return cluster_here.scheduler()


@pytest.fixture
def workers(cluster_here):
    """The processes of two workers."""
    return cluster_here.workers()


def end(process):
    process.kill()
    process.wait()


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Maps, one of them broken, and what a run on this machine makes of them."""
    folder = tmp_path_factory.mktemp("local")
    return estimated(folder, FRAMES, *IMAGES, broken={5: b""}, width=300, height=200)


@pytest.fixture
def far(local, tmp_path):
    """The same maps in a folder of the test's own."""
    shutil.copytree(local / "maps", tmp_path / "far" / "maps")
    return tmp_path / "far"


def assert_is_that_of_a_local_run(far, local):
    here, there = contents(local), contents(far)
    differing = {name for name in here.keys() | there.keys() if here.get(name) != there.get(name)}
    assert differing <= {"rolls.csv.inputs"}  # the one holds the times of the inputs, which differ


# the program, which gives up sooner on a scheduler that it has lost
IMPATIENT = """
from rollcli.__main__ import main
from rollcli.run.workers import cluster
cluster._CONNECT_S = 2
main()
"""


def start(far, scheduler):
    """A run on the cluster."""
    arguments = ("estimate", "maps", "-q", "-o", "rolls.csv", *IMAGES, "--scheduler", scheduler)
    line = [sys.executable, "-c", IMPATIENT, *arguments]
    return subprocess.Popen(line, cwd=far, env=environment(), stderr=subprocess.PIPE, text=True)


def test_a_cluster_that_loses_a_worker_gives_the_bytes_of_a_local_run(local, far, scheduler, workers):
    run = start(far, scheduler)
    wait_for_files(far, "v/[!.]*.png", 9, run)
    workers[0].kill()
    _, err = run.communicate(timeout=120)
    assert run.returncode == 3, err
    assert_is_that_of_a_local_run(far, local)


def test_conversions_on_a_cluster_give_the_bytes_of_a_local_run(tmp_path, scheduler, workers):
    write_maps(tmp_path / "maps", 3)
    write_pair(tmp_path, "a.png", road_map(width=160, height=80) / 2)
    lay = {**dict.fromkeys(ALIGNMENT_COLUMNS, 0), "width": 160, "height": 80}
    (tmp_path / "lay.json").write_text(json.dumps(lay))  # which workers do not see by this name
    (tmp_path / "maps" / "frame1.png").write_bytes(b"no map")
    lines = {
        "derotate": ("maps", "--roll", "2"),
        "vdisparity": ("maps", "--counts"),
        "disparity": ("--left", "left", "--right", "right", "--num-disparities", "32", "--align", "lay.json"),
    }
    for name, arguments in lines.items():
        status = 0 if name == "disparity" else 3
        assert rollcli(name, *arguments, "-o", f"here/{name}", cwd=tmp_path).status == status
        far = rollcli(name, *arguments, "-o", f"far/{name}", "--scheduler", scheduler, cwd=tmp_path)
        assert far.status == status, far.err
    assert contents(tmp_path / "far") == contents(tmp_path / "here")


def test_a_scheduler_that_is_lost_ends_the_run_which_goes_on_without_it(local, far, cluster_here, workers):
    run = start(far, cluster_here.address)
    wait_for_files(far, "v/[!.]*.png", 9, run)
    cluster_here.process.kill()
    _, err = run.communicate(timeout=60)
    assert run.returncode == 1
    *broken, said = err.splitlines()  # the scheduler may be lost before this frame is told
    assert broken in ([], ["rollcli: maps/frame5.png: is empty"])
    assert said.startswith(f"rollcli: {cluster_here.address}: the connection to the scheduler is lost; ")
    assert said.endswith(" rows kept, continue with --resume")
    assert rollcli("estimate", "maps", "-q", "-o", "rolls.csv", *IMAGES, "--resume", cwd=far).status == 3
    assert_is_that_of_a_local_run(far, local)


# a worker that notes what it does
ODD = """
from pathlib import Path
import rollcli
from rollcli.run.workers import cluster
from rollcli.run import frame_task
run_frame = frame_task.run_frame
def noted(*given):
    Path("worked").touch()
    return run_frame(*given)
frame_task.run_frame = noted
"""


@pytest.mark.parametrize(
    ("oddity", "problem"),
    [
        ('cluster.__version__ = "0.0"', f"has rollcli 0.0, this is {__version__}"),
        ("cluster.is_file = lambda path: False", "inputs must lie on storage that the workers share"),
    ],
)
def test_a_worker_that_joins_later_and_cannot_take_part_gets_no_work_also_when_all_others_are_new(
    local, far, tmp_path, cluster_here, scheduler, workers, oddity, problem
):
    import distributed

    odd = tmp_path / "odd"
    odd.mkdir()
    (odd / "preload.py").write_text(ODD + oddity)
    for number in range(400):  # so many that the worker is there before the end
        shutil.copy(local / "maps" / "frame0.png", far / "maps" / f"more{number:03}.png")
    run = start(far, scheduler)
    wait_for_files(far, "v/[!.]*.png", 9, run)
    joined_late = cluster_here.dask("worker", odd, scheduler, *ONE_PROCESS, "--preload", "preload.py")
    try:
        said = next(line for line in run.stderr if "gets no work" in line)
        # what is in hand some frames later is for these two alone
        wait_for_files(far, "v/[!.]*.png", len([*far.glob("v/*.png")]) + 20, run)
        gone = [*workers]
        workers.clear()
        with distributed.Client(scheduler) as client:
            cluster_here.workers()
            client.wait_for_workers(5, timeout=60)
        for worker in gone:
            end(worker)
        _, err = run.communicate(timeout=300)
    finally:
        end(joined_late)
    assert run.returncode == 3, err
    assert "gets no work" not in err
    assert said.startswith("rollcli: worker tcp://")
    assert said.endswith(f"{problem}; it gets no work\n")
    assert not (odd / "worked").exists()
    assert len((far / "rolls.csv").read_text().splitlines()) == 1 + FRAMES + 400


def test_a_result_that_was_lost_and_came_to_a_worker_that_cannot_take_part_is_made_again():
    lost = Mock(**{"exception.return_value": None, "result.side_effect": WorkerError("does not see a.png")})
    executor = Mock(**{"send.return_value": (lost, set())})
    assert cluster.ClusterFuture(executor, [1], 0).result() is executor.retry.return_value


def test_a_worker_that_has_no_such_program_or_files_or_may_not_write_is_named(tmp_path, monkeypatch):
    there = tmp_path / "a.png"
    there.write_bytes(b"123")
    assert probe(__version__, {str(there): 3}, [str(tmp_path / "a.png")], "run") == ""
    assert "this is 0.0" in probe("0.0", {}, [], "run")
    assert f"does not see {tmp_path / 'b.png'}" in probe(__version__, {str(tmp_path / "b.png"): 3}, [], "run")
    assert "does not see" in probe(__version__, {str(there): 4}, [], "run")
    mark = str(tmp_path / "v" / "mark")
    assert "what they write must lie on storage" in probe(__version__, {}, [mark], "run")
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    assert probe(__version__, {}, [str(there)], "run") == f"cannot write to {tmp_path}"


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
    if address:
        assert done.err.startswith(f"rollcli: --scheduler {address!r}: ")
        assert done.err.endswith("; an address looks like tcp://host:8786\n")
    else:
        assert done.err.startswith("rollcli: Invalid value for '--scheduler': the text is empty")
    assert contents(tmp_path) == before


def test_a_scheduler_without_workers_ends_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "_FIRST_WORKER_S", 0.5)
    write_maps(tmp_path / "maps", 2)
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, processes=False, **HERE) as empty:
        done = estimate_here(empty.scheduler_address, tmp_path)
    assert done.status == 1
    assert f"{empty.scheduler_address}: has no workers" in done.err
    assert rollcli("estimate", "maps", "-o", "rolls.csv", cwd=tmp_path).status == 0


# the bucket comes first: workers take its settings over when they start
def test_workers_that_share_only_a_bucket_give_the_bytes_of_a_local_run(
    bucket, local, tmp_path, scheduler, workers
):
    upload(local / "maps", f"{bucket}/maps")
    line = ("estimate", f"{bucket}/maps/", "-o", f"{bucket}/rolls.csv", "--derotated", f"{bucket}/upright")
    line = (*line, "--part-rows", "8", "--scheduler", scheduler)
    (tmp_path / "driver").mkdir()
    run = started(*line, cwd=tmp_path / "driver", stderr=None)
    wait_until(lambda: len(list_names(f"{bucket}/rolls.csv")) > 1, run)
    run.kill()
    assert run.wait() != 0
    resumed = started(*line, "--resume", "-q", cwd=tmp_path / "driver", stderr=None)
    wait_until(lambda: len(list_names(f"{bucket}/rolls.csv")) > 3, resumed)
    workers[0].kill()
    assert resumed.wait(timeout=120) == 3

    expected = (local / "rolls.csv").read_bytes().replace(b"maps/", f"{bucket}/maps/".encode())
    assert joined(f"{bucket}/rolls.csv") == expected
    assert objects_below(f"{bucket}/upright") == contents(local / "upright")


HERE = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": ":0", "threads_per_worker": 1}


@pytest.fixture(scope="module")
def workers_here():
    """Two workers in this process."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, processes=False, **HERE) as made:
        yield made


@pytest.mark.parametrize("name", ["scheduler.json", "./scheduler"])
def test_a_scheduler_is_named_by_its_file_too(workers_here, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    address = workers_here.scheduler_address
    (tmp_path / name).write_text(json.dumps({"type": "Scheduler", "address": address}))
    check_scheduler(name)
    assert scheduler_address(name) == address
    assert scheduler_address("tcp://far:8786") == "tcp://far:8786"
    assert scheduler_address("far:8786") == "far:8786"


def test_a_result_that_is_asked_for_once_the_connection_is_lost_says_so(workers_here):
    executor = cluster.ClusterExecutor(workers_here.scheduler_address, Work(str, str), Workers(2))
    future = executor.submit([1])
    wait_until(future.done)
    executor._client.close()
    with pytest.raises(WorkerError, match="the connection to the scheduler is lost"):
        future.result()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "the scheduler file cannot be read: no such file or directory"),
        (b"", "is not a file that dask scheduler wrote"),
        (b"[" * 100_000, "is not a file that dask scheduler wrote"),
        (b'{"id": 1}', "is not a file that dask scheduler wrote"),
        (b"[1]", "is not a file that dask scheduler wrote"),
    ],
)
def test_a_scheduler_file_that_is_not_there_or_is_none_is_refused(tmp_path, content, said):
    file = tmp_path / "scheduler.json"
    if content is not None:
        file.write_bytes(content)
    assert error_of(UsageError, check_scheduler, str(file)) == f"--scheduler {file}: {said}"


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = error_of(UsageError, check_scheduler, "tcp://far:1")
    assert said.startswith("--scheduler needs the extra cluster: ")
    assert said.endswith(" -m pip install distributed")


def certificate(folder, name):
    """A certificate that vouches for itself, and its key."""
    cert, key = folder / f"{name}.pem", folder / f"{name}.key"
    line = shlex.split("openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=localhost")
    subprocess.run([*line, "-out", cert, "-keyout", key], check=True, capture_output=True)
    return cert, key


def settings(cert, key, trusted):
    """Dask's settings as variables: everyone has this certificate, and trusts one."""
    tls = {
        f"{role}__{what}": path
        for role in ("SCHEDULER", "WORKER", "CLIENT")
        for what, path in (("CERT", cert), ("KEY", key))
    }
    tls["CA_FILE"] = trusted
    named = {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(path) for name, path in tls.items()}
    return {**named, "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}


@pytest.fixture
def encrypted(tmp_path):
    """The address of a scheduler with workers, and the settings of who may take part."""
    variables = settings(*certificate(tmp_path, "node"), tmp_path / "node.pem")
    made = Cluster(tmp_path, "--protocol", "tls", **variables)
    try:
        made.workers()
        yield made.address, variables
    finally:
        made.end()


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make certificates with")
def test_a_run_on_an_encrypted_cluster_gives_the_same_rows_and_a_stranger_is_refused(tmp_path, encrypted):
    """Connections are encrypted by Dask's own settings."""
    address, variables = encrypted
    assert address.startswith("tls://")
    write_maps(tmp_path / "maps", 3)
    rollcli("estimate", "maps", "-q", "-o", "local.csv", cwd=tmp_path)

    given = ("-q", "-o", "far.csv", "--scheduler", address)
    done = rollcli("estimate", "maps", *given, cwd=tmp_path, **variables)

    assert (done.status, done.err) == (0, "")
    assert (tmp_path / "far.csv").read_bytes() == (tmp_path / "local.csv").read_bytes()
    stranger = settings(*certificate(tmp_path, "stranger"), tmp_path / "node.pem")
    for others in (stranger, {}):
        refused = rollcli("estimate", "maps", "-o", "no.csv", "--scheduler", address, cwd=tmp_path, **others)
        assert refused.status in (1, 2)
        assert address in refused.err
        assert refused.err.count("\n") == 1
        assert not (tmp_path / "no.csv").exists()
