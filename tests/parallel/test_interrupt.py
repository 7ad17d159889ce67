"""Signals stop a run where Python lets it handle them."""

import signal
import sys
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
def test_outside_of_a_run_the_first_signal_ends_the_program_and_no_other_disturbs_that(first):
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
