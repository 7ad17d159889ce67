"""Signals stop a run where Python lets it handle them."""

import signal
from concurrent.futures import ThreadPoolExecutor

from rollcli.parallel.interrupt import stop_on_signals, stop_signals


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
