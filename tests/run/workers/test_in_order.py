"""The order of results, the bound on tasks in flight, retries and stops, with a fake executor."""

import pytest

from rollcli.run.workers.in_order import Work, in_order
from rollcli.run.workers.interrupt import Stop
from rollcli.run.workers.tasks import LocalExecutor


class DiedError(Exception):
    """A worker has died."""


class FakeFuture:
    def __init__(self, executor, task):
        self.executor, self.task, self.started = executor, task, False

    def result(self):
        self.started = True
        if self.task in self.executor.deadly:
            raise DiedError
        return f"did {self.task}"

    def cancel(self):
        return not (self.started or self.task in self.executor.begun)


class FakeExecutor:
    """Runs tasks when they are waited for; `begun` cannot be cancelled, `deadly` kill their worker."""

    worker_died = (DiedError,)

    def __init__(self, window=3, begun=(), deadly=()):
        self.window, self.begun, self.deadly = window, begun, deadly
        self.submitted, self.retried = [], []

    def submit(self, task):
        self.submitted.append(task)
        return FakeFuture(self, task)

    def retry(self, task):
        self.retried.append(task)
        return f"retried {task}"


def test_results_come_in_the_order_of_the_tasks():
    assert list(in_order("abcdef", FakeExecutor(), Stop())) == [f"did {task}" for task in "abcdef"]


def test_no_more_tasks_are_taken_than_the_window_holds():
    taken, executor = [], FakeExecutor(window=3)
    results = in_order((taken.append(task) or task for task in range(100)), executor, Stop())
    for done in range(1, 50):
        next(results)
        assert len(taken) - done < 3
    assert taken == executor.submitted


def test_a_task_whose_worker_died_is_retried_in_its_place():
    executor = FakeExecutor(deadly="c")
    assert list(in_order("abcd", executor, Stop())) == ["did a", "did b", "retried c", "did d"]
    assert executor.retried == ["c"]


def test_a_stop_yields_what_has_begun_and_cancels_the_rest():
    stop, executor = Stop(), FakeExecutor(window=4, begun="abc")
    results = in_order("abcdefgh", executor, stop)
    assert next(results) == "did a"
    stop.asked = True
    assert list(results) == ["did b", "did c"]
    assert executor.submitted == list("abcd")


def test_a_worker_that_dies_after_a_stop_is_not_retried():
    stop, executor = Stop(), FakeExecutor(window=4, begun="abcd", deadly="b")
    results = in_order("abcd", executor, stop)
    next(results)
    stop.asked = True
    assert list(results) == []
    assert executor.retried == []


def test_an_error_of_a_task_reaches_the_caller():
    def fail(task):
        raise ValueError(task)

    with pytest.raises(ValueError, match="a"):
        next(in_order("a", LocalExecutor(Work(fail, None)), Stop()))


def test_this_process_begins_no_task_after_a_stop():
    stop, begun = Stop(), []
    results = in_order("abc", LocalExecutor(Work(lambda task: begun.append(task) or task, None)), stop)
    assert next(results) == "a"
    stop.asked = True
    assert list(results) == []
    assert begun == ["a"]
