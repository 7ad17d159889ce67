"""A call that fails costs a run no more than it says; `make fuzz` lets every call fail with every error."""

import os

import pytest

if not hasattr(os, "fork"):
    pytest.skip("faults are injected into forked processes", allow_module_level=True)

from tests.fuzz.faults import Bench


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return Bench(tmp_path_factory.mktemp("faults"))


def test_a_run_makes_calls_of_every_kind_that_can_fail(bench):
    assert {"open", "write", "close", "replace", "stat", "mkdir", "flock"} <= set(bench.whole.counts)


def test_a_run_with_a_call_that_fails_is_resumed_to_the_same_bytes(bench):
    sample = list(bench.faults(step=40))

    assert [(fault, problem) for fault in sample if (problem := bench.problem(fault))] == []
