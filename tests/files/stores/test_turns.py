"""Tasks that wait for the network wait together; those that compute do so one at a time."""

import threading

from rollcli.files import storage
from rollcli.files.stores import locations as turns
from rollcli.files.stores.locations import computing, wait_for_room, waiting_for_network
from rollcli.run.workers.chunks import Work, Workers
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.tasks import run_tasks

_COUNT = 4
_together = threading.Barrier(_COUNT)


def fetch_and_square(number):
    """Wait until so many tasks wait, too: alone, this would break the barrier."""
    with waiting_for_network():
        _together.wait(timeout=30)
    return number**2


def lost(number, reason):
    return reason


def test_tasks_of_one_worker_wait_for_the_network_together_and_answer_in_order():
    tasks = range(3 * _COUNT)
    results = run_tasks(tasks, Work(fetch_and_square, lost), Stop(), Workers(jobs=1, threads=_COUNT))
    assert list(results) == [number**2 for number in tasks]


def test_what_tasks_have_read_ahead_is_bounded_and_no_task_waits_for_ever(monkeypatch):
    monkeypatch.setattr(turns, "_BYTES_IN_HAND", 100)
    most, parts = 0, (30, 40)  # a task reads two files: with all eight at once, 560

    def task():
        nonlocal most
        for _ in range(50):
            with computing():
                for size in parts:
                    with waiting_for_network():
                        wait_for_room(size)
                        most = max(most, sum(turns._held_bytes.copy().values()))

    threads = [threading.Thread(target=task) for _ in range(8)]
    for each in threads:
        each.start()
    for each in threads:
        each.join(timeout=60)
    assert not any(each.is_alive() for each in threads)
    assert 0 < most <= 100 + sum(parts)
    assert not turns._held_bytes


def test_objects_that_tasks_read_count_as_read_ahead(bucket):
    storage.write_bytes(f"{bucket}/x", b"123")
    with computing():
        assert storage.read_bytes(f"{bucket}/x") == b"123"
        assert list(turns._held_bytes.values()) == [3]
