"""Which executor the tasks get, and how it ends."""

import pytest

from rollcli.errors import UsageError
from rollcli.run.workers import tasks as runs
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.in_order import Workers
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.pool import PoolExecutor, prepare_worker
from rollcli.run.workers.tasks import require_scheduler, run_tasks
from tests.run.workers.tasks import lost, run

WORK = Work(run, lost)


@pytest.mark.parametrize(
    ("count", "jobs", "threads", "processes"),
    [
        (5, 1, 1, 0),
        (5, 2, 1, 2),
        (2, 3, 1, 2),
        (1, 3, 1, 0),
        (0, 3, 1, 0),
        (1, 1, 2, 1),
        (0, 1, 4, 0),
        (3, 2, 4, 2),
    ],
)
def test_there_are_as_many_processes_as_tasks_and_jobs_allow(count, jobs, threads, processes):
    executor = runs._executor(count, WORK, Workers(jobs, threads=threads))
    if processes == 0:
        assert executor is None
    else:
        executor.close(at_once=True)
        assert isinstance(executor, PoolExecutor)
        assert len(executor._pool) == processes


def test_no_scheduler_is_asked_for_unless_one_is_named():
    require_scheduler(None)
    with pytest.raises(UsageError, match=r"^--scheduler"):
        require_scheduler("")


def test_workers_that_were_started_early_do_the_tasks_and_those_too_many_end():
    with runs.started_early(3, prepare_worker) as started:
        processes = {worker._process.pid: worker._process for worker in started}
        assert len(processes) == 3
        tasks = [("signals",) for _ in range(20)]
        used = {pid for pid, _, _ in run_tasks(tasks, WORK, Stop(), Workers(2, started=started))}
        assert used <= processes.keys()
        assert len(started) == 1
    assert not any(process.is_alive() for process in processes.values())
    with runs.started_early(1, prepare_worker) as none:
        assert none == []
