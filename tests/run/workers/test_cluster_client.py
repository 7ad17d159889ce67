"""Chunks on a Dask cluster of this process, or of processes that may die."""

import json
import sys

import pytest

pytest.importorskip("distributed", reason="the extra cluster is not installed")

from distributed import LocalCluster

from rollcli.errors import UsageError
from rollcli.run.workers.chunks import Work
from rollcli.run.workers.cluster import ClusterExecutor, check_scheduler, scheduler_address
from rollcli.run.workers.in_order import SharedPaths
from tests.run.workers.tasks import lost, run

pytestmark = pytest.mark.slow

WORK = Work(run, lost)
HERE = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": ":0", "threads_per_worker": 1}


@pytest.fixture(scope="module")
def workers_here():
    """Two workers in this process."""
    with LocalCluster(n_workers=2, processes=False, **HERE) as made:
        yield made


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
