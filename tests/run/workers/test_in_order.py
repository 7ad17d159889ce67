"""The order of results, the sizes of chunks, halving and stops, with an executor in this process."""

import itertools
import random
import threading
from collections import Counter
from functools import cache
from types import SimpleNamespace

import pytest

from rollcli.errors import InputError, WorkerDiedError
from rollcli.run.workers import chunks as chunk_sizes
from rollcli.run.workers.chunks import Chunk, Done, Work
from rollcli.run.workers.interrupt import Stop
from tests.run.workers.tasks import in_order

WORK = Work(str, str)
LOST = [("lost", task, "killed twice") for task in range(1000)]


class FakeFuture:
    def __init__(self, executor, chunk):
        self.executor, self.chunk, self.polled = executor, chunk, False

    def done(self):
        return self.polled

    def result(self):
        if self.executor.deadly & set(self.chunk):
            self.executor.deaths.update(self.executor.deadly & set(self.chunk))
            raise WorkerDiedError("killed")
        return self.executor.do(self.chunk)


class FakeExecutor:
    """Does a chunk when it is waited for; `deadly` tasks kill their worker, `seconds` is a task's time."""

    threads = 1

    def __init__(self, workers=1, deadly=(), seconds=0.1, most=10**9):
        self.workers, self.deadly, self.seconds, self.most = workers, set(deadly), seconds, most
        self.submitted, self.retried, self.deaths, self.stops = [], [], Counter(), 0
        self.in_hand = self.most_in_hand = 0

    def submit(self, chunk, *, first=False):
        self.submitted.append(list(chunk))
        self.in_hand += 1
        self.most_in_hand = max(self.most_in_hand, self.in_hand)
        return FakeFuture(self, chunk)

    def wait(self, future):
        self.in_hand -= 1
        future.polled = True

    def do(self, chunk):
        done = [] if self.stops else chunk[: self.most]
        return Done([f"did {task}" for task in done], self.seconds * len(done))

    def retry(self, chunk):
        self.retried.extend(chunk)
        raise WorkerDiedError("killed twice")

    def stop(self):
        self.stops += 1


@pytest.mark.parametrize("count", [0, 1, 2, 7, 1000])
@pytest.mark.parametrize("workers", [1, 3, 64])
@pytest.mark.parametrize("seconds", [1e-6, 0.005, 0.1, 30.0])
def test_results_are_those_of_single_tasks_in_their_order(count, workers, seconds):
    executor = FakeExecutor(workers, seconds=seconds)
    assert list(in_order(range(count), executor, Stop())) == [f"did {task}" for task in range(count)]
    assert [task for chunk in executor.submitted for task in chunk] == list(range(count))
    assert executor.most_in_hand <= 3 * workers


@pytest.mark.parametrize(("seconds", "size"), [(0.005, 200), (0.1, 10), (5.0, 1)])
def test_a_chunk_is_worth_about_a_second(seconds, size):
    executor = FakeExecutor(2, seconds=seconds)
    list(in_order(range(4000), executor, Stop()))
    assert {len(chunk) for chunk in executor.submitted if 2000 <= chunk[0] < 3000} <= {size, size - 1}


@pytest.mark.parametrize("seed", range(5))
def test_tasks_that_end_at_once_make_no_later_chunk_too_long(seed):
    rng, executor = random.Random(seed), FakeExecutor(64)
    costs = [rng.choice([1e-5, 0.01]) for _ in range(200_000)]  # files that are not there end at once
    executor.do = lambda chunk: Done(list(chunk), sum(costs[task] for task in chunk))
    assert list(in_order(range(len(costs)), executor, Stop())) == list(range(len(costs)))
    assert max(sum(costs[task] for task in chunk) for chunk in executor.submitted) < 2.0


def test_a_slow_chunk_keeps_no_other_worker_waiting_and_not_everything_in_memory():
    class SlowFirst(FakeExecutor):
        def wait(self, future):
            others = [each for each in self.futures if each is not self.futures[0] and not each.polled]
            for each in others or [self.futures[0]]:
                super().wait(each)

        def submit(self, chunk, *, first=False):
            self.futures.append(super().submit(chunk, first=first))
            return self.futures[-1]

    executor = SlowFirst(4)
    executor.futures = []
    results = in_order(range(10_000), executor, Stop())
    assert next(results) == "did 0"
    assert 8 * 4 < len(executor.submitted) <= 12 * 4
    assert executor.most_in_hand <= 3 * 4 + 1
    assert sum(1 for _ in results) == 9_999


def test_what_must_be_read_in_order_is_read_here_just_before_a_worker_gets_it():
    executor, read = FakeExecutor(4, deadly={5}, seconds=1e-3), []
    results = in_order(range(100), executor, Stop(), prepare=lambda task: read.append(task) or task)
    for number, result in enumerate(results):
        assert result == (LOST[5] if number == 5 else f"did {number}")
        assert len(read) <= number + 3 * 4 + 1  # these are held in memory
    assert read == list(range(100))
    assert {len(chunk) for chunk in executor.submitted} == {1}


@pytest.mark.parametrize("deadly", [{0}, {517}, {999}, {300, 301, 640}])
def test_what_kills_workers_is_alone_in_the_end_and_costs_no_other_task(deadly):
    executor = FakeExecutor(2, deadly, seconds=0.005)
    done = list(in_order(range(1000), executor, Stop()))
    assert done == [LOST[task] if task in deadly else f"did {task}" for task in range(1000)]
    assert executor.retried == sorted(deadly)
    assert max(executor.deaths.values()) <= 9  # 200 tasks are halved eight times


def test_the_rest_of_a_chunk_that_took_too_long_comes_before_all_others():
    executor = FakeExecutor(2, seconds=0.01, most=7)
    assert list(in_order(range(500), executor, Stop())) == [f"did {task}" for task in range(500)]


def test_a_stop_ends_the_results_before_the_first_task_that_was_not_begun():
    stop, executor = Stop(), FakeExecutor(2)
    results = in_order(range(100), executor, stop)
    assert [next(results) for _ in range(5)] == [f"did {task}" for task in range(5)]
    stop.asked = True
    rest = list(results)
    assert rest == [f"did {task}" for task in range(5, 5 + len(rest))]
    assert executor.stops
    assert len(rest) < 60


def test_a_worker_that_dies_after_a_stop_is_not_retried():
    stop, executor = Stop(), FakeExecutor(2, deadly={1})
    results = in_order(range(10), executor, stop)
    next(results)
    stop.asked = True
    assert list(results) == []
    assert executor.retried == []


def test_an_error_of_a_task_reaches_the_caller_after_the_results_before_it():
    executor = FakeExecutor()
    executor.do = lambda chunk: Done([], 0.0, ValueError(chunk[0])) if chunk[0] else Done(["did"], 0.1)
    results = in_order(range(100), executor, Stop())
    assert next(results) == "did"
    with pytest.raises(ValueError, match="1"):
        next(results)


def job_of(do):
    return WORK.job(1)._replace(do=do)


def chunk_of(do, tasks, stopped=None):
    return Chunk(job_of(do), tasks, stopped or threading.Event())


def test_a_chunk_ends_between_tasks_when_it_is_stopped():
    stopped = threading.Event()

    def do(task):
        if task == 3:
            stopped.set()
        return task

    assert chunk_of(do, range(10), stopped).done().results == [0, 1, 2, 3]
    assert chunk_of(do, range(10), stopped).done().results == []


def test_a_chunk_gives_back_what_it_has_not_begun_in_time(monkeypatch):
    times = iter([0.0, 0.0, 0.5, 1.5, 2.5, 3.5, 4.0, 5.0])
    monkeypatch.setattr(chunk_sizes.time, "monotonic", lambda: next(times))
    done = chunk_of(lambda task: task, range(5)).done()
    assert (done.results, done.error) == ([0, 1, 2], None)


def test_an_error_ends_a_chunk_after_the_results_before_it():
    def fail(task):
        if task == 2:
            raise ValueError(task)
        return task

    done = chunk_of(fail, range(5)).done()
    assert done.results == [0, 1]
    assert isinstance(done.error, RuntimeError)
    assert "ValueError in " in str(done.error)


class InOrder:
    """Does what it is given once a result is asked for, in an order of its own."""

    def __init__(self, order):
        self.order, self.given = order, []

    def submit(self, do, place):
        self.given.append((do, place))
        return SimpleNamespace(result=lambda: self.results()[place])

    @cache  # noqa: B019
    def results(self):
        return {place: do(place) for do, place in (self.given[each] for each in self.order)}


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))))
def test_of_several_failures_the_first_tasks_is_raised_whatever_the_order_of_the_threads(order):
    def fail(task):
        if task in "bd":
            raise InputError(task)
        return task

    done = Chunk(job_of(fail), "abcd", threading.Event(), InOrder(order)).done()
    assert (done.results, str(done.error)) == (["a"], "b")


def test_a_failure_is_not_raised_before_the_tasks_in_front_of_it_are_done():
    stopped = threading.Event()

    def stop_and_fail(task):
        stopped.set()
        raise InputError(task)

    done = Chunk(job_of(stop_and_fail), "ab", stopped, InOrder((1, 0))).done()
    assert (done.results, done.error) == ([], None)
