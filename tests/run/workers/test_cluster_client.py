"""What the executor for a cluster asks of Dask's client, without a scheduler."""

import logging
import sys
from concurrent.futures import Future
from types import SimpleNamespace

import cv2
import pytest

pytest.importorskip("distributed", reason="the extra cluster is not installed")

from distributed import KilledWorker

from rollcli import __version__
from rollcli.errors import ClusterError, OutputError, UsageError
from rollcli.files.stores import locations as turns
from rollcli.run.workers import cluster
from rollcli.run.workers.cluster import ClusterExecutor, ClusterFuture, check_scheduler
from rollcli.run.workers.in_order import SharedPaths, Work

WORK = Work(lambda task: ("did", task, turns._turn.locked()), lambda task, reason: ("lost", task, reason))


class Client:
    """A client of two workers, of one thread and of two, which runs what is submitted at once."""

    status = "running"

    def __init__(self):
        self.asked, self.plugins, self.closed, self.answers = [], [], [], {"a": "", "b": ""}

    def run(self, function, version, sizes, marks, *, on_error):
        self.asked.append((function, version, sizes, marks, on_error))
        return self.answers

    def register_plugin(self, plugin):
        self.plugins.append(plugin)

    def nthreads(self):
        return {"a": 1, "b": 2}

    def get_executor(self, *, pure):
        assert not pure  # equal tasks are tasks of their own
        return self

    def submit(self, do, task):
        future = Future()
        future.set_result(do(task))
        return future

    def close(self, **options):
        self.closed.append(options)


@pytest.fixture
def client(monkeypatch):
    client = Client()
    monkeypatch.setattr(cluster, "_connect", lambda address: client)
    return client


@pytest.fixture(autouse=True)
def logging_of_before():
    before = logging.root.manager.disable
    yield
    assert logging.root.manager.disable == before


@pytest.mark.parametrize(("threads", "window"), [(1, 12), (4, 12), (16, 48)])
def test_every_thread_of_the_cluster_has_tasks_in_hand(client, monkeypatch, threads, window):
    left = []
    monkeypatch.setattr("distributed.secede", lambda: left.append(True))
    executor = ClusterExecutor("tcp://far:1", WORK, SharedPaths(), threads)
    assert executor.window == window
    assert executor.worker_died == (KilledWorker,)
    # of several tasks a thread lets others begin, and has its turn while it computes
    assert executor.submit(5).result() == ("did", 5, threads > 1)
    assert len(left) == (threads > 1)
    executor.close(at_once=False)


def test_workers_are_prepared_and_dask_is_silent_until_the_cluster_is_left(client, monkeypatch):
    told = []
    monkeypatch.setattr(cv2, "setNumThreads", told.append)
    executor = ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)
    assert not logging.getLogger("distributed").isEnabledFor(logging.CRITICAL)
    (plugin,) = client.plugins
    assert plugin.name == "rollcli"
    plugin.setup(None)
    assert told == [1]
    assert client.closed == []
    executor.close(at_once=True)
    assert len(client.closed) == 1


def test_a_cluster_that_cannot_take_part_is_left(client):
    client.answers = {"a": "", "b": "does not see a.png"}
    with pytest.raises(ClusterError, match=r"^worker b: does not see a\.png$"):
        ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)
    assert len(client.closed) == 1
    assert client.plugins == []


def test_workers_are_asked_for_files_that_are_there_and_folders_that_are_no_urls(
    client, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.png").write_bytes(b"123")
    (tmp_path / "folder").mkdir()
    shared = SharedPaths(("a.png", "none.png", "folder", "s3://bucket/b.png"), ("up", "s3://bucket/up"))
    ClusterExecutor("tcp://far:1", WORK, shared, 1).close(at_once=False)
    ClusterExecutor("tcp://far:1", WORK, shared, 1).close(at_once=False)
    marks = []
    for probe, version, sizes, [mark], on_error in client.asked:
        assert (probe, version, on_error) == (cluster.probe, __version__, "return")
        assert sizes == {str(tmp_path / "a.png"): 3}
        assert mark.startswith(str(tmp_path / "up" / ".rollcli-check-"))
        marks.append(mark)
    assert len(set(marks)) == 2  # two runs at once do not remove each other's
    assert list((tmp_path / "up").iterdir()) == []


def test_a_folder_that_cannot_be_written_is_named_and_no_mark_is_left_in_the_others(client, tmp_path):
    (tmp_path / "file").write_bytes(b"")
    shared = SharedPaths((), (str(tmp_path / "up"), str(tmp_path / "file" / "v"), str(tmp_path / "road")))
    with pytest.raises(OutputError, match=r"file/v/\.rollcli-check-\w+: cannot be written: not a directory$"):
        ClusterExecutor("tcp://far:1", WORK, shared, 1)
    assert client.asked == []
    assert len(client.closed) == 1
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "up"]


def test_a_task_that_killed_its_workers_is_lost(client):
    executor = ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)
    assert executor.retry(7) == (
        "lost",
        7,
        "every worker that tried it died: killed for memory, perhaps, or crashed",
    )
    executor.close(at_once=False)


def test_a_lost_connection_is_said_when_tasks_are_sent_and_when_results_are_wanted(client):
    executor = ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)
    client.status = "closed"
    lost = r"^tcp://far:1: the connection to the scheduler is lost$"
    with pytest.raises(ClusterError, match=lost):
        executor.submit(1)
    executor.close(at_once=False)

    future = Future()
    waiting = ClusterFuture(future, SimpleNamespace(status="running"), "tcp://far:1")
    assert waiting.cancel()
    future.set_running_or_notify_cancel()  # as Dask does with the tasks of a client that closes
    with pytest.raises(ClusterError, match=lost):
        waiting.result()


def test_a_task_that_is_done_cannot_be_withdrawn():
    done = Future()
    done.set_result(3)
    future = ClusterFuture(done, SimpleNamespace(status="closed"), "tcp://far:1")
    assert not future.cancel()
    assert future.result() == 3


@pytest.mark.parametrize(
    "use",
    [lambda: check_scheduler("tcp://far:1"), lambda: ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)],
    ids=["check", "executor"],
)
def test_without_the_extra_it_is_named(monkeypatch, use):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError) as caught:
        use()
    assert str(caught.value) == "--scheduler needs the extra cluster: pip install 'rollcli[cluster]'"
