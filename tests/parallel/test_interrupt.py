"""Signals stop a run where Python lets it handle them."""

import signal
import sys
import weakref
from concurrent.futures import ThreadPoolExecutor

import pytest

from rollcli.parallel.interrupt import raise_on_signals, stop_on_signals, stop_signals


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
def test_outside_of_a_run_the_first_signal_ends_the_program_and_no_other_disturbs_that(first, monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    before = {each: signal.getsignal(each) for each in stop_signals()}
    try:
        raise_on_signals()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(first)
        for each in before:
            signal.raise_signal(each)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals cannot be held back here")
def test_of_signals_that_come_together_one_ends_the_program_and_nothing_is_said_of_the_others(monkeypatch):
    before = {each: signal.getsignal(each) for each in stop_signals()}
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    try:
        raise_on_signals()
        signal.pthread_sigmask(signal.SIG_BLOCK, before)
        for each in before:
            signal.raise_signal(each)
        with pytest.raises(KeyboardInterrupt):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, before)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, before)
        for each, handler in before.items():
            signal.signal(each, handler)
    assert complaints == []


class Thing:
    """What a weak reference can refer to."""


def signal_where_python_swallows_it(number):
    """Let a signal come while the callback of a weak reference runs."""

    def callback(reference):
        signal.raise_signal(number)

    thing = Thing()
    reference = weakref.ref(thing, callback)
    del thing
    assert reference() is None


def test_a_second_signal_that_python_swallows_is_not_printed_and_the_next_one_ends_the_run(monkeypatch):
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    with stop_on_signals() as stop:
        signal.raise_signal(signal.SIGINT)
        signal_where_python_swallows_it(signal.SIGINT)
        assert stop.asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert complaints == []


def test_outside_of_a_run_one_that_python_swallows_is_not_printed_and_the_next_one_counts(monkeypatch):
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    before = {each: signal.getsignal(each) for each in stop_signals()}
    try:
        raise_on_signals()
        signal_where_python_swallows_it(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
    assert complaints == []


def test_other_errors_that_python_swallows_are_told_as_ever(monkeypatch):
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)

    def callback(reference):
        raise LookupError("as ever")

    with stop_on_signals():
        thing = Thing()
        reference = weakref.ref(thing, callback)
        del thing
    assert reference() is None
    assert [type(each.exc_value) for each in complaints] == [LookupError]
    assert sys.unraisablehook == complaints.append
