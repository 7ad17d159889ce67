"""Real worker processes: order, deaths, retries, errors and how they end."""

import contextlib
import os
import signal
import sys
from types import SimpleNamespace

import pytest

from rollcli.errors import InputError, WorkerError
from rollcli.run.workers import pool as pools
from rollcli.run.workers import pool as workers
from rollcli.run.workers.in_order import Work, Workers
from rollcli.run.workers.interrupt import Stop, stop_signals
from rollcli.run.workers.pool import PoolExecutor
from rollcli.run.workers.tasks import run_tasks
from tests.run.workers.tasks import lost, run

WORK = Work(run, lost)


def results(*tasks, jobs=2):
    return list(run_tasks(tasks, WORK, Stop(), Workers(jobs)))


@contextlib.contextmanager
def pool(jobs=2):
    executor = PoolExecutor(jobs, WORK)
    try:
        yield executor
    finally:
        executor.close(at_once=True)


def test_a_slow_task_keeps_its_place_before_quick_ones(tmp_path):
    event = tmp_path / "event"
    tasks = [("wait", event), *(("give", number) for number in range(5)), ("touch", event)]
    assert results(*tasks) == ["waited", 0, 1, 2, 3, 4, "touched"]


def test_a_task_that_kills_its_worker_once_is_done_by_another(tmp_path):
    tasks = [("give", 1), ("die_once", tmp_path / "mark"), *(("give", number) for number in range(2, 12))]
    assert results(*tasks) == [1, "survived", *range(2, 12)]


def test_tasks_that_wait_while_one_is_tried_again_are_done_though_none_follows(tmp_path):
    with pool(jobs=1) as executor:
        dying, *others = [
            executor.submit(task)
            for task in [("die_once", tmp_path / "mark"), *(("give", number) for number in range(3))]
        ]
        with pytest.raises(executor.worker_died):
            dying.result()
        assert executor.retry(dying.task) == "survived"
        assert [other.result() for other in others] == [0, 1, 2]


def test_a_task_that_kills_two_workers_is_lost_and_costs_no_other_task():
    done = results(("give", 1), ("die",), *(("give", number) for number in range(2, 12)))
    assert done[1][:2] == ("lost", ("die",))
    assert "died twice" in done[1][2]
    assert [done[0], *done[2:]] == [1, *range(2, 12)]


def test_errors_on_purpose_are_raised_as_they_are_and_others_say_where():
    with pytest.raises(InputError, match=r"^a\.png: is no map$"):
        results(("raise", "input"), ("give", 1))
    with pytest.raises(RuntimeError, match=r"KeyError in .*tasks\.py:\d+: 'key'"):
        results(("raise", "key"), ("give", 1))


def test_a_worker_computes_in_one_thread():
    assert results(("threads",), ("threads",)) == [1, 1]


def test_a_queued_task_can_be_cancelled_and_a_running_one_cannot(tmp_path):
    event = tmp_path / "event"
    with pool() as executor:
        running = executor.submit(("wait", event))
        futures = [executor.submit(("wait", event)) for _ in range(7)]
        assert not running.cancel()
        assert futures[-1].cancel()
        assert not futures[-1].cancel()
        event.touch()
        assert running.result() == "waited"


def test_beside_its_task_a_worker_has_one_more_which_a_stop_cannot_withdraw(tmp_path):
    event = tmp_path / "event"
    with pool(jobs=1) as executor:
        running, spare, queued = (executor.submit(("wait", event)) for _ in range(3))
        assert [future.cancel() for future in (running, spare, queued)] == [False, False, True]
        event.touch()
        assert [future.result() for future in (running, spare)] == ["waited", "waited"]


def test_a_worker_that_died_idle_is_replaced_before_its_next_task():
    with pool() as executor:
        assert executor.submit(("give", 1)).result() == 1
        for worker in executor._workers:
            worker.kill()
            worker._process.join()
        assert executor.submit(("give", 2)).result() == 2


def test_workers_end_with_their_executor():
    with pool() as executor:
        assert executor.submit(("give", 1)).result() == 1
        processes = [worker._process for worker in executor._workers]
    for process in processes:
        with pytest.raises(ProcessLookupError):
            os.kill(process.pid, 0)


def test_an_inherited_file_stays_open_in_the_workers(tmp_path):
    fcntl = pytest.importorskip("fcntl", reason="this system has no flock")
    path = tmp_path / "locked"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    executor = PoolExecutor(1, WORK, keep_open=descriptor)
    try:
        assert executor.submit(("give", 1)).result() == 1
        os.close(descriptor)  # the lock stays, since the worker holds the same open file
        with path.open() as other, pytest.raises(BlockingIOError):
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    finally:
        executor.close(at_once=True)


def test_a_task_is_tried_again_when_no_other_runs(tmp_path):
    mark, busy, event = (tmp_path / name for name in ("mark", "busy", "event"))
    with pool() as executor:
        held = executor.submit(("hold", busy, event))
        dying = executor.submit(("die_then_look", mark, busy))
        with pytest.raises(executor.worker_died):
            dying.result()
        make_progress = executor.make_progress

        def let_go():
            event.touch()
            make_progress()

        executor.make_progress = let_go
        assert executor.retry(dying.task) is False
        assert held.result() == "held"


def test_what_a_dead_worker_left_is_cleared_before_its_task_is_tried_again(tmp_path):
    cleared = []
    executor = PoolExecutor(1, Work(run, lost, cleared.append))
    try:
        tasks = [("give", 1), ("die_once", tmp_path / "mark"), ("give", 2), ("give", 3)]
        futures = [executor.submit(task) for task in tasks]
        assert futures[0].result() == 1
        assert cleared == []
        with pytest.raises(executor.worker_died):
            futures[1].result()
        assert cleared[0] == tasks[1]
        assert [future.result() for future in futures[2:]] == [2, 3]
    finally:
        executor.close(at_once=True)


def test_the_tasks_after_one_that_killed_its_worker_keep_their_order(tmp_path):
    tasks = [
        ("die_once", tmp_path / "mark"),
        *(("append", tmp_path / "order", str(number)) for number in range(8)),
    ]
    with pool(jobs=1) as executor:
        dying, *others = [executor.submit(task) for task in tasks]
        with pytest.raises(executor.worker_died):
            dying.result()
        for other in others:
            other.result()
    assert (tmp_path / "order").read_text() == "01234567"


def test_of_few_tasks_each_worker_gets_one(tmp_path):
    event = tmp_path / "event"
    with pool() as executor:  # the first one waits for what the second one does
        futures = [executor.submit(("wait", event)), executor.submit(("touch", event))]
        assert [future.result() for future in futures] == ["waited", "touched"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_workers_leave_the_signals_to_their_parent():
    with pool(jobs=1) as executor:
        process, ignored, blocked = executor.submit(("signals",)).result()
        assert {*stop_signals()} <= ignored
        assert {*stop_signals()} <= blocked
        for each in (signal.SIGINT, signal.SIGTERM):
            os.kill(process, each)
        assert executor.submit(("signals",)).result()[0] == process


def test_workers_end_after_their_task_or_at_once(tmp_path):
    for at_once, status in ((False, 0), (True, -signal.SIGKILL)):
        executor = PoolExecutor(1, WORK)
        executor.submit(("append", tmp_path / f"{at_once}", "done")).result()
        executor.submit(("append", tmp_path / f"{at_once}", " done"))
        (worker,) = executor._workers
        executor.close(at_once=at_once)
        assert worker._process.exitcode == status
    assert (tmp_path / "False").read_text() == "done done"


def test_when_a_further_worker_cannot_start_the_others_end(monkeypatch):
    started = []

    class Limited(workers.Worker):
        def __init__(self, *arguments):
            if len(started) == 2:
                raise WorkerError("no more")
            super().__init__(*arguments)
            started.append(self)

    monkeypatch.setattr(pools, "Worker", Limited)
    with pytest.raises(WorkerError, match="no more"):
        PoolExecutor(3, WORK)
    assert [worker._process.is_alive() for worker in started] == [False, False]


def test_a_system_that_starts_no_process_is_said_with_a_remedy(monkeypatch):
    def fail():
        raise OSError(24, "Too many open files")

    spawn = SimpleNamespace(Pipe=fail)
    monkeypatch.setattr(workers.multiprocessing, "get_context", lambda kind: {"spawn": spawn}[kind])
    with pytest.raises(
        WorkerError,
        match=r"^a worker process cannot start: .*Too many open files; try fewer of them, with --jobs$",
    ):
        PoolExecutor(2, WORK)


@pytest.mark.parametrize("error", [ImportError("no NumPy"), OSError("no library"), MemoryError("no memory")])
def test_a_worker_that_cannot_be_set_up_answers_with_the_reason(monkeypatch, error):
    def fail():
        raise error

    monkeypatch.setattr(workers, "prepare_worker", fail)
    found = workers._prepare()
    assert isinstance(found, WorkerError)
    assert str(found) == f"a worker process cannot start: {error}; try fewer of them, with --jobs"
    monkeypatch.setattr(workers, "prepare_worker", lambda: None)
    assert workers._prepare() is None
