"""What keeps the project in order agrees with what the project says of itself."""

import re
import subprocess
import sys

from tests.run_cli import ROOT


def found(pattern, *parts):
    """Every match in a file of the project; there is at least one."""
    matches = re.findall(pattern, ROOT.joinpath(*parts).read_text("utf-8"))
    assert matches, (pattern, parts)
    return matches


def test_hooks_check_with_the_oldest_ruff_that_developers_may_have():
    (oldest,) = found(r'"ruff>=([\d.]+)"', "pyproject.toml")
    (rev,) = found(r"ruff-pre-commit\n\s+rev: v([\d.]+)", ".pre-commit-config.yaml")
    assert rev == oldest


def test_ci_runs_on_every_python_that_the_package_names():
    named = found(r"Python :: (3\.\d+)", "pyproject.toml")
    (matrix,) = found(r"python: \[(.*)\]", ".github", "workflows", "ci.yml")
    assert re.findall(r"[\d.]+", matrix) == named
    assert ".ci/run" in found(r"run: (\S+)", ".github", "workflows", "ci.yml")


def test_ci_runs_on_windows_and_macos_with_tests_that_are_there():
    (systems,) = found(r"os: \[(.*)\]", ".github", "workflows", "ci.yml")
    assert systems == "macos-latest, windows-latest"
    named = found(r"(?<=[ :])tests(?:/[\w./]+)?(?=\s)", ".github", "workflows", "ci.yml")
    assert "tests/test_other_systems.py" in named
    assert [each for each in named if not (ROOT / each).exists()] == []


def test_what_all_tests_share_limits_the_threads_of_numpy_before_numpy_loads():
    line = [sys.executable, "-c", "import sys, tests.conftest; sys.exit('numpy' in sys.modules)"]
    assert subprocess.run(line, cwd=ROOT, check=False).returncode == 0
