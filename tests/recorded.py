"""What this version answers, recorded: no other version answers otherwise unless its commit says why.

``python -m tests.recorded [PACKAGE ...]`` makes the records anew. A package has its cases in
``tests/PACKAGE/test_recorded.py`` and its answers in ``tests/PACKAGE/recorded.json``, a line a case, or
sessions at a prompt in ``tests/PACKAGE/sessions.txt``; see `tests.sessions`.
"""

import dataclasses
import functools
import importlib
import json
import sys
import tempfile
from collections.abc import Mapping
from enum import Enum
from pathlib import Path

import pytest

from rollcli.errors import RollcliError
from rollcli.run.workers.pool import limit_blas_threads

limit_blas_threads()  # before NumPy is loaded, as every command does
import numpy as np  # noqa: E402

from tests import sessions  # noqa: E402

PACKAGES = ("cli", "estimator", "evaluate", "files", "pictures", "report", "rig", "run", "simulate", "stereo")
_GRID = 5  # rows and columns of an image whose values are recorded
_ROUNDING = 1e-5  # what is smaller may be nothing, rounded
_DIGITS = 8


def check(package, case, answer, *, rel=1e-6, least=1e-6):
    """Fail where the answer, of numbers, texts, arrays and records, is not the recorded one."""
    known, found = (dict(_leaves(each)) for each in (_record(package)[case], _plain(answer)))
    expected = {
        name: pytest.approx(value, rel=rel, abs=least) if isinstance(value, float) else value
        for name, value in known.items()
    }
    assert found == expected


def recorded_test(package, cases, *, rel=1e-6, least=1e-6):
    """The test that each case of a package has the recorded answer; `least` may depend on the case."""

    @pytest.mark.parametrize("case", cases)
    def test_answers_are_those_recorded(case):
        within = least(case) if callable(least) else least
        check(package, case, cases[case](), rel=rel, least=within)

    return test_answers_are_those_recorded


def made(make, *arguments, **options):
    """What is made, or the sentence that says why not."""
    try:
        return make(*arguments, **options)
    except RollcliError as error:
        return str(error)


@functools.cache
def _record(package):
    return json.loads(_path(package).read_text("utf-8"))


def _path(package):
    return Path(__file__).parent / package / "recorded.json"


def _plain(value):
    """The value as JSON holds it; of an image its size, sums and some of its pixels."""
    if dataclasses.is_dataclass(value) or hasattr(value, "_asdict"):
        names = [each.name for each in dataclasses.fields(value)] if dataclasses.is_dataclass(value) else None
        return _plain({name: getattr(value, name) for name in names or value._fields})
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(_image(value) if value.ndim > 1 and value.size > 64 else value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else str(value)
    return value.item() if isinstance(value, np.generic) else value


def _image(values):
    whole = values.astype(float)
    known = np.isfinite(whole)
    places = np.ix_(*(np.linspace(0, size - 1, _GRID + 2).astype(int)[1:-1] for size in whole.shape[:2]))
    return {
        "shape": values.shape,
        "known": float(known.mean()),
        "valid": float((known & (np.abs(whole) > _ROUNDING)).mean()),
        "mean": float(whole[known].mean()) if known.any() else None,
        "rms": float(np.sqrt(np.square(whole[known]).mean())) if known.any() else None,
        "pixels": whole[places].ravel().tolist(),
    }


def _leaves(value, name=""):
    """Yield each single value of a nested one with where it stands."""
    if isinstance(value, dict | list):
        yield f"{name}:", len(value)
        for key, each in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _leaves(each, f"{name}/{key}")
    else:
        yield name, value


def main(packages):
    """Write the records."""
    for package in packages or PACKAGES:
        if sessions.path_of(package).exists():
            with tempfile.TemporaryDirectory() as folder:
                sessions.record(package, Path(folder))
        cases = getattr(importlib.import_module(f"tests.{package}.test_recorded"), "CASES", {})
        lines = [f"{json.dumps(name)}: {json.dumps(_plain(make()))}" for name, make in cases.items()]
        if lines:
            _path(package).write_text("{\n" + ",\n".join(lines) + "\n}\n", "utf-8", newline="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
