"""Real worker processes: order, deaths, retries, errors and how they end."""

import contextlib
import os

import pytest

from rollcli.errors import InputError
from rollcli.parallel.in_order import Work
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.pool import PoolExecutor
from rollcli.parallel.run_tasks import run_tasks
from rollcli.parallel.workers import Workers
from tests.parallel.tasks import lost, run

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
