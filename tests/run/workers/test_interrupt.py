"""Signals stop a run where Python lets it handle them."""

import signal
import sys
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor

import pytest

from rollcli.run.workers.interrupt import came_of_interrupt, raise_on_signals, stop_on_signals, stop_signals


@pytest.fixture(autouse=True)
def handlers_of_before(monkeypatch):
    """Other tests get the handlers of before, and hear what Python swallows."""
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    before = {each: signal.getsignal(each) for each in stop_signals()}
    yield
    for each, handler in before.items():
        signal.signal(each, handler)


@pytest.fixture
def complaints(monkeypatch):
    """What Python swallows and does not print."""
    swallowed = []
    monkeypatch.setattr(sys, "unraisablehook", swallowed.append)
    return swallowed


def test_a_run_in_a_thread_leaves_the_signals_to_its_program():
    def handlers():
        with stop_on_signals() as stop:
            return [signal.getsignal(each) for each in stop_signals()], stop.asked

    before = [signal.getsignal(each) for each in stop_signals()]
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(handlers).result() == (before, False)
    with stop_on_signals():
        assert all(signal.getsignal(each) not in before for each in stop_signals())
    assert [signal.getsignal(each) for each in stop_signals()] == before


@pytest.mark.parametrize("first", stop_signals())
def test_outside_of_a_run_the_first_signal_ends_the_program_and_no_other_disturbs_that(first):
    raise_on_signals()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(first)
    for each in stop_signals():
        signal.raise_signal(each)


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals cannot be held back here")
def test_of_signals_that_come_together_one_ends_the_program_and_nothing_is_said_of_the_others(complaints):
    together = stop_signals()
    try:
        raise_on_signals()
        signal.pthread_sigmask(signal.SIG_BLOCK, together)
        for each in together:
            signal.raise_signal(each)
        with pytest.raises(KeyboardInterrupt):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, together)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, together)
    assert complaints == []


class Thing:
    """What a weak reference can refer to."""


def where_python_swallows_errors(do, *given):
    """Do something in the callback of a weak reference."""
    thing = Thing()
    reference = weakref.ref(thing, lambda _: do(*given))
    del thing
    assert reference() is None


def test_a_second_signal_that_python_swallows_is_not_printed_and_the_next_one_ends_the_run(complaints):
    with stop_on_signals() as stop:
        signal.raise_signal(signal.SIGINT)
        where_python_swallows_errors(signal.raise_signal, signal.SIGINT)
        assert stop.asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert complaints == []


def test_outside_of_a_run_one_that_python_swallows_is_not_printed_and_the_next_one_counts(complaints):
    raise_on_signals()
    where_python_swallows_errors(signal.raise_signal, signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert complaints == []


def test_other_errors_that_python_swallows_are_told_as_ever(complaints):
    def fail():
        raise LookupError("as ever")

    with stop_on_signals():
        where_python_swallows_errors(fail)
    assert [type(each.exc_value) for each in complaints] == [LookupError]
    assert sys.unraisablehook == complaints.append


class Disturbed:
    """A lock that a signal comes to while it is left, as it may to one of Python's."""

    def __enter__(self):
        return self

    def __exit__(self, *error):
        threading.Lock().release()


def leave_disturbed(signals):
    with stop_on_signals(), Disturbed():
        for _ in range(signals):
            signal.raise_signal(signal.SIGINT)


def test_a_lock_that_the_second_signal_disturbs_is_no_other_error_than_the_signal():
    with pytest.raises(KeyboardInterrupt):
        leave_disturbed(signals=2)
    with pytest.raises(RuntimeError, match="release unlocked lock"):
        leave_disturbed(signals=1)


def test_an_error_that_no_interrupt_came_before_is_one():
    assert not came_of_interrupt(RuntimeError())
    error = RuntimeError()
    error.__context__ = ValueError()
    assert not came_of_interrupt(error)
    error.__context__.__cause__ = KeyboardInterrupt()
    assert came_of_interrupt(error)
