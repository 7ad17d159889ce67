"""Which cases of a test every change runs, and which `make test-all` alone; which examples are drawn."""

from collections.abc import Iterable
from typing import Any

import hypothesis
import pytest

# the same examples wherever the same modules are loaded, however busy the machine
repeatable = hypothesis.settings(derandomize=True, max_examples=60, database=None)


def mostly_slow(cases: Iterable[Any], *quick: Any) -> list[Any]:
    """The cases of a parametrized test, marked as slow but for those that are named."""
    return [case if case in quick else _slow(case) for case in cases]


def _slow(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow)
