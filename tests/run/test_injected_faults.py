"""A call that fails costs a run no more than it says; `make fuzz` lets every call fail with every error."""

import os
import re
import sys

import pytest

from tests.run_cli import ROOT, ended

pytestmark = pytest.mark.slow

if not hasattr(os, "fork"):
    pytest.skip("faults are injected into forked processes", allow_module_level=True)


def test_a_run_with_a_call_that_fails_is_resumed_to_the_same_bytes():
    # in a process of its own: a fork of this one would lack the threads that OpenCV may have started here
    line = [sys.executable, "-m", "tests.fuzz.faults", "40"]
    done = ended(line, ROOT, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    (tried,) = re.findall(r"^(\d+) faults, 0 finds$", done.stdout, flags=re.M)
    assert int(tried) >= 5
    of_rows, of_parts = re.findall(r"^rolls\.\w+: calls: (.*)$", done.stdout, flags=re.M)
    both = {"open", "write", "close", "replace", "stat", "mkdir"}
    assert both | {"flock"} <= set(of_rows.split())
    assert both | {"scandir"} <= set(of_parts.split())
