"""What the documentation shows is what happens."""

import doctest
import importlib
import re
import types

import numpy as np
import pytest

import rollcli
from tests.run_cli import ROOT

FUNCTIONS = [name for name in rollcli.__all__ if isinstance(getattr(rollcli, name), types.FunctionType)]
README = (ROOT / "README.md").read_text("utf-8")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_examples_of_a_public_function_hold(name):
    function = getattr(rollcli, name)
    module = importlib.import_module(function.__module__)
    found = doctest.DocTestFinder(recurse=False).find(function, name, globs=vars(module).copy())
    runner = doctest.DocTestRunner()
    with np.printoptions(legacy=False):
        for test in found:
            runner.run(test)
    assert runner.tries > 0
    assert runner.failures == 0


def test_the_readmes_session_in_python_holds(tmp_path, monkeypatch):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    (session,) = re.findall(r"```python\n(.*?)```", README, flags=re.S)
    test = doctest.DocTestParser().get_doctest(session, {}, "README.md", "README.md", 0)
    runner = doctest.DocTestRunner()
    runner.run(test)
    assert runner.tries == 10
    assert runner.failures == 0
    assert (tmp_path / "v.png").stat().st_size > 1000
