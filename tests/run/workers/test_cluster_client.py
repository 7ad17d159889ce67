"""Chunks on a Dask cluster of this process, or of processes that may die."""

import json
import logging
import sys
import time
from pathlib import Path

import cv2
import pytest

pytest.importorskip("distributed", reason="the extra cluster is not installed")

import dask
from distributed import LocalCluster

from rollcli.errors import ClusterError, OutputError, UsageError
from rollcli.files.stores import locations as turns
from rollcli.run.workers import cluster
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.cluster import ClusterExecutor, check_scheduler, scheduler_address
from rollcli.run.workers.in_order import SharedPaths
from rollcli.run.workers.interrupt import Stop
from tests.run.workers.tasks import in_order, lost, run

pytestmark = pytest.mark.slow

WORK = Work(run, lost)
HERE = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": ":0", "threads_per_worker": 1}


@pytest.fixture(scope="module")
def workers_here():
    """Two workers in this process."""
    with LocalCluster(n_workers=2, processes=False, **HERE) as made:
        yield made


@pytest.fixture(autouse=True)
def logging_of_before():
    before = logging.root.manager.disable
    yield
    assert logging.root.manager.disable == before


def executor_on(made, work=WORK, threads=1, shared=None):
    return ClusterExecutor(made.scheduler_address, work, shared or SharedPaths(), threads)


def results(made, tasks, threads=1, stop=None):
    executor = executor_on(made, threads=threads)
    try:
        yield from in_order(tasks, executor, stop or Stop())
    finally:
        executor.close(at_once=False)


@pytest.mark.parametrize("threads", [1, 4])
def test_results_come_in_the_order_of_the_tasks(workers_here, threads):
    tasks = [("give", number) for number in range(500)]
    assert list(results(workers_here, tasks, threads)) == list(range(500))


_waiting: list[int] = []
_together: set[int] = set()


def wait_a_while(task):
    """Note how many tasks wait at once."""
    with turns.waiting_for_network():
        _waiting.append(task)
        time.sleep(0.05)
        _together.add(len(_waiting))
        _waiting.remove(task)
    return task


def test_tasks_that_wait_for_the_network_wait_together(workers_here):
    executor = executor_on(workers_here, Work(wait_a_while, lost), threads=4)
    try:
        assert list(in_order(range(64), executor, Stop())) == list(range(64))
    finally:
        executor.close(at_once=False)
    assert max(_together) == 4  # workers of one process share its threads


def test_an_error_of_a_task_ends_the_run_after_the_results_before_it(workers_here):
    done = results(workers_here, [("give", 1), ("give", 2), ("raise", "key"), ("give", 3)])
    assert [next(done), next(done)] == [1, 2]
    with pytest.raises(RuntimeError, match=r"KeyError in .*tasks\.py:\d+: 'key'"):
        next(done)


def test_a_stop_ends_a_chunk_after_the_task_in_hand(workers_here, tmp_path):
    event, busy = tmp_path / "event", tmp_path / "busy"
    executor = executor_on(workers_here)
    try:
        late = ("append", tmp_path / "late", "x")
        future = executor.submit([("hold", busy, event), late, late])
        while not busy.exists():
            time.sleep(0.01)
        executor.stop()
        event.touch()
        while not future.done():
            executor.wait(future)
        assert future.result().results == ["held"]
    finally:
        executor.close(at_once=False)
    assert not (tmp_path / "late").exists()


def test_workers_that_join_are_counted_and_used_and_those_that_leave_are_not(workers_here, monkeypatch):
    monkeypatch.setattr(cluster, "_LOOK_S", 0.1)
    executor = executor_on(workers_here)
    try:
        assert executor.workers == 2
        workers_here.scale(5)
        wait_for(lambda: executor.workers == 5)
        workers_here.scale(2)
        wait_for(lambda: executor.workers == 2)
    finally:
        workers_here.scale(2)
        executor.close(at_once=False)


def wait_for(condition):
    give_up = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


def test_what_kills_workers_is_found_in_its_chunk_and_costs_no_other_task(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    settings = {"distributed.scheduler.allowed-failures": 0, "distributed.admin.log-length": 0}
    with dask.config.set(settings), LocalCluster(n_workers=2, processes=True, **HERE) as made:
        executor = executor_on(made)
        try:
            tasks = [*(("give", number) for number in range(5)), ("die",), ("give", 6), ("give", 7)]
            futures = [executor.submit(tasks[:4]), executor.submit(tasks[4:])]
            while not all(future.done() for future in futures):
                executor.wait(futures[1])
            assert futures[0].result().results == [0, 1, 2, 3]
            with pytest.raises(executor.worker_died):
                futures[1].result()
            done = list(in_order(tasks, executor, Stop()))
        finally:
            executor.close(at_once=True)
    assert done.pop(5) == ("lost", ("die",), cluster._DIED)
    assert done == [0, 1, 2, 3, 4, 6, 7]


def test_workers_are_prepared_and_dask_is_silent_until_the_cluster_is_left(workers_here, monkeypatch):
    told = []
    monkeypatch.setattr(cv2, "setNumThreads", told.append)
    executor = executor_on(workers_here)
    assert not logging.getLogger("distributed").isEnabledFor(logging.CRITICAL)
    assert told == [1, 1]
    executor.close(at_once=True)


def test_a_folder_that_cannot_be_written_is_named_and_no_mark_is_left_in_the_others(workers_here, tmp_path):
    (tmp_path / "file").write_bytes(b"")
    shared = SharedPaths((), (str(tmp_path / "up"), str(tmp_path / "file" / "v"), str(tmp_path / "road")))
    with pytest.raises(OutputError, match=r"file/v/\.rollcli-check-\w+: cannot be written: not a directory$"):
        executor_on(workers_here, shared=shared)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "up"]


def test_a_lost_connection_is_said_when_chunks_are_sent_and_when_results_are_wanted(workers_here, tmp_path):
    executor = executor_on(workers_here)
    future = executor.submit([("wait", tmp_path / "event")])
    executor._client.close()
    (tmp_path / "event").touch()
    lost_connection = f"^{workers_here.scheduler_address}: the connection to the scheduler is lost$"
    with pytest.raises(ClusterError, match=lost_connection):
        executor.submit([("give", 1)])
    with pytest.raises(ClusterError, match=lost_connection):
        executor.wait(future)
    with pytest.raises(ClusterError, match=lost_connection):
        future.result()
    executor.close(at_once=False)


def test_a_scheduler_is_named_by_its_file_too(workers_here, tmp_path):
    file = tmp_path / "scheduler.json"
    file.write_text(json.dumps({"type": "Scheduler", "address": workers_here.scheduler_address}))
    check_scheduler(str(file))
    assert scheduler_address("tcp://far:8786") == "tcp://far:8786"
    assert scheduler_address("far:8786") == "far:8786"


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
    with pytest.raises(UsageError) as caught:
        check_scheduler(str(file))
    assert str(caught.value) == f"--scheduler {file}: {said}"


@pytest.mark.parametrize(
    "use",
    [lambda: check_scheduler("tcp://far:1"), lambda: ClusterExecutor("tcp://far:1", WORK, SharedPaths(), 1)],
    ids=["check", "executor"],
)
def test_without_the_extra_it_is_named(monkeypatch, use):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError) as caught:
        use()
    assert str(caught.value).startswith("--scheduler needs the extra cluster: ")
    assert str(caught.value).endswith(" -m pip install distributed")
