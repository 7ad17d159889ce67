"""Tasks that wait for the network wait together; those that compute do so one at a time."""

import threading

from rollcli.files.stores.turns import computing, tasks_in_hand, waiting_for_network
from rollcli.parallel.in_order import Work
from rollcli.parallel.interrupt import Stop
from rollcli.parallel.run_tasks import run_tasks
from rollcli.parallel.workers import Workers

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


def test_one_computes_at_a_time():
    computes, most = 0, 0

    def compute():
        nonlocal computes, most
        for _ in range(200):
            with computing():
                computes += 1
                most = max(most, computes)
                computes -= 1
                with waiting_for_network():
                    pass

    threads = [threading.Thread(target=compute) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert most == 1


def test_waiting_without_a_turn_changes_nothing():
    with waiting_for_network(), computing():
        pass


def test_only_urls_need_several_tasks_in_hand():
    assert tasks_in_hand(["maps/a.png", "out"]) == 1
    assert tasks_in_hand(["maps/a.png", "s3://bucket/out"]) > 1
