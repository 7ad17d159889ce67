"""Real worker processes: how many, order, deaths, retries, errors and how they end."""

import contextlib
import os
import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from rollcli.errors import InputError, WorkerError
from rollcli.run.workers import pool as pools
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import Stop, stop_signals
from rollcli.run.workers.pool import PoolExecutor
from rollcli.run.workers.tasks import run_tasks
from tests.run.workers.tasks import lost, run
from tests.run_cli import ended, environment, wait_until
from tests.slow import mostly_slow

WORK = Work(run, lost)


def results(*tasks, jobs=2):
    return list(run_tasks(tasks, WORK, Stop(), Workers(jobs)))


@contextlib.contextmanager
def pool(jobs=2, work=WORK):
    executor = PoolExecutor(jobs, work, Workers())
    try:
        yield executor
    finally:
        executor.close(at_once=True)


def settled(executor, future):
    """What was done of a chunk."""
    while not future.done():
        executor.wait(future)
    return future.result().results


def test_a_slow_task_keeps_its_place_before_quick_ones(tmp_path):
    event = tmp_path / "event"
    tasks = [("wait", event), ("touch", event), *(("give", number) for number in range(4))]
    assert results(*tasks) == ["waited", "touched", 0, 1, 2, 3]


def test_a_task_that_kills_its_worker_once_is_done_by_another(tmp_path):
    tasks = [("give", 1), ("die_once", tmp_path / "mark"), *(("give", number) for number in range(2, 12))]
    assert results(*tasks) == [1, "survived", *range(2, 12)]


@pytest.mark.parametrize(("count", "deadly"), mostly_slow([(12, 1), (3000, 2000)], (12, 1)))
def test_a_task_that_kills_two_workers_is_lost_and_costs_no_other_task(count, deadly):
    tasks = [("give", number) for number in range(count)]
    tasks[deadly] = ("die",)
    done = results(*tasks)
    assert done[deadly][:2] == ("lost", ("die",))
    assert "died twice" in done[deadly][2]
    assert [*done[:deadly], *done[deadly + 1 :]] == [each for each in range(count) if each != deadly]


def test_errors_on_purpose_are_raised_as_they_are_and_others_say_where():
    with pytest.raises(InputError, match=r"^a\.png: is no map$"):
        results(("raise", "input"), ("give", 1))
    with pytest.raises(RuntimeError, match=r"KeyError in .*tasks\.py:\d+: 'key'"):
        results(("raise", "key"), ("give", 1))


def test_a_worker_computes_in_one_thread():
    assert results(("threads",), ("threads",)) == [1, 1]


def test_a_stop_ends_a_chunk_after_the_task_in_hand_and_begins_no_other(tmp_path):
    event = tmp_path / "event"
    with pool(jobs=1) as executor:
        tasks = [("hold", tmp_path / "busy", event), *(("append", tmp_path / "late", "x") for _ in range(5))]
        running, spare, queued = (executor.submit(tasks) for _ in range(3))
        wait_until((tmp_path / "busy").exists)
        executor.stop()
        executor.stop()
        assert (spare.done(), queued.done()) == (False, True)  # the former is with the worker
        time.sleep(0.1)  # the worker hears of it meanwhile
        event.touch()
        assert [settled(executor, each) for each in (running, spare, queued)] == [["held"], [], []]
    assert not (tmp_path / "late").exists()


def test_a_worker_that_died_with_nothing_to_do_is_replaced_before_its_next_chunk():
    with pool() as executor:
        assert settled(executor, executor.submit([("give", 1)])) == [1]
        for worker in executor._pool:
            worker.kill()
            worker._process.join()
        assert settled(executor, executor.submit([("give", 2)])) == [2]


def test_what_a_dead_worker_left_is_cleared_before_its_chunk_is_known_to_be_lost(tmp_path):
    cleared = []
    with pool(1, Work(run, lost, cleared.extend)) as executor:
        tasks = [("give", 1), ("die_once", tmp_path / "mark"), ("give", 2)]
        dying, spare = executor.submit(tasks), executor.submit([("give", 3)])
        while not dying.done():
            assert cleared == []
            executor.wait(dying)
        assert cleared[:3] == tasks
        assert settled(executor, spare) == [3]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_workers_leave_the_signals_to_their_parent():
    with pool(jobs=1) as executor:
        ((process, ignored, blocked),) = settled(executor, executor.submit([("signals",)]))
        assert {*stop_signals()} <= ignored
        assert {*stop_signals()} <= blocked
        for each in (signal.SIGINT, signal.SIGTERM):
            os.kill(process, each)
        assert settled(executor, executor.submit([("signals",)]))[0][0] == process


def test_workers_end_after_their_task_or_at_once(tmp_path):
    for at_once, status in ((False, 0), (True, -signal.SIGKILL)):
        busy, event = tmp_path / f"busy{at_once}", tmp_path / f"event{at_once}"
        executor = PoolExecutor(1, WORK, Workers())
        executor.submit([("hold", busy, event), ("append", tmp_path / "late", "x")])
        wait_until(busy.exists)
        threading.Timer(0.3, event.touch).start()
        (worker,) = executor._pool
        executor.close(at_once=at_once)
        assert worker._process.exitcode == status
        assert busy.exists() == at_once  # it was let go once it was held
    assert not (tmp_path / "late").exists()


def test_when_a_further_worker_cannot_start_the_others_end(monkeypatch):
    started = []

    class Limited(pools.Worker):
        def __init__(self, *arguments):
            if len(started) == 2:
                raise WorkerError("no more")
            super().__init__(*arguments)
            started.append(self)

    monkeypatch.setattr(pools, "Worker", Limited)
    with pytest.raises(WorkerError, match="no more"):
        PoolExecutor(3, WORK, Workers())
    assert [worker._process.is_alive() for worker in started] == [False, False]


HOW_IT_STARTS = """
import sys, threading
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.pool import Worker
if __name__ == "__main__":
    if "threads" in sys.argv:
        threading.Thread(target=threading.Event().wait, daemon=True).start()
    worker = Worker(Work(str, str), 1)
    print(type(worker._process).__name__)
    worker.kill()
    worker.join()
"""


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="only Linux tells its threads")
def test_a_process_with_one_thread_is_forked_and_one_with_more_is_not(tmp_path):
    (tmp_path / "start.py").write_text(HOW_IT_STARTS)

    def kind(*arguments):
        line = [sys.executable, "start.py", *arguments]
        return ended(line, tmp_path, env=environment(OPENBLAS_NUM_THREADS="1")).stdout

    assert kind() == "ForkProcess\n"
    assert kind("threads") == "SpawnProcess\n"
