"""The group: what it says of itself, and how errors end."""

import importlib.metadata as metadata
import itertools
import re
from importlib.metadata import PackageNotFoundError
from unittest.mock import Mock

import pytest

import rollcli as package
from tests.run_cli import ROOT, environment, python, rollcli, rollcli_process, write_maps


def test_the_process_calls_itself_rollcli_and_its_version_is_the_packages(tmp_path):
    assert rollcli_process("--version", cwd=tmp_path).out == f"rollcli {package.__version__}\n"
    assert rollcli_process("--help", cwd=tmp_path).out.startswith("Usage: rollcli ")


def test_versions_names_python_and_every_dependency(tmp_path):
    done = rollcli("--versions", cwd=tmp_path)
    first, second, *names = (line.split()[0] for line in done.out.splitlines())
    assert (first, second) == ("rollcli", "Python")
    declared = (ROOT / "pyproject.toml").read_text("utf-8").partition("[project.urls]")[0]
    asked = set(re.findall(r'"([a-z0-9-]+)>=', declared.lower())) - {"tomli", "hatchling"}
    assert set(names) - {"tomli"} == asked - {"hatch-fancy-pypi-readme"}
    assert len(names) == len(set(names))
    assert "not installed" not in done.out


def test_a_package_that_is_missing_is_named_as_such(tmp_path, monkeypatch):
    def version(name):
        if name in ("tqdm", "opencv-python-headless", "plotly"):
            raise PackageNotFoundError
        return "1.0"

    monkeypatch.setattr(metadata, "version", version)
    lines = rollcli("--versions", cwd=tmp_path).out.splitlines()
    assert "tqdm not installed" in lines
    assert "opencv-python 1.0" in lines
    assert not any(line.startswith("plotly") for line in lines)


def test_versions_ends_with_pythons_where_rollcli_was_not_installed(tmp_path, monkeypatch):
    monkeypatch.setattr(metadata, "requires", Mock(side_effect=PackageNotFoundError("rollcli")))
    names = [line.split()[0] for line in rollcli("--versions", cwd=tmp_path).out.splitlines()]
    assert names == ["rollcli", "Python"]


def test_help_leaves_two_of_a_hundred_columns_free_on_a_wide_screen(tmp_path):
    lines = rollcli("simulate", "--help", cwd=tmp_path, COLUMNS="200").out.splitlines()
    assert 90 < max(map(len, lines)) <= 98


LOADS = """
import sys
sys.argv = ["rollcli", *{words}]
from rollcli.__main__ import main
try:
    main()
except SystemExit as end:
    print(int(end.code or 0), [name for name in {names}.split() if name in sys.modules])
"""


def output_and_loaded(folder, words, names):
    """What the program says, and in a last line its status and which of these modules it has loaded."""
    done = python(LOADS.format(words=words, names=repr(names)), cwd=folder, check=True)
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ("arguments", "loaded"),
    [
        (["--version"], "numpy cv2 tqdm tifffile multiprocessing"),
        (["--help"], "numpy cv2 tqdm tifffile multiprocessing"),
        (["estimate", "maps", "-q", "-j", "2", "-o", "out", "--dry-run"], "numpy cv2"),
    ],
)
def test_neither_help_and_version_nor_a_dry_run_load_what_is_slow(tmp_path, arguments, loaded):
    write_maps(tmp_path / "maps", 2)
    assert output_and_loaded(tmp_path, arguments, loaded)[-1] == "0 []"


@pytest.mark.parametrize(
    ("work", "said", "verbose"),
    [
        ('{}["key"]', "KeyError: 'key'", []),
        ('__import__("marshal").loads(b"")', "EOFError: ", []),
        ('{}["key"]', "KeyError: 'key'", ["-v"]),
        ('{}["key"]', "KeyError: 'key'", ["--verbose"]),
    ],
)
def test_what_nobody_thought_of_is_one_line_and_verbose_shows_where_it_is_from(tmp_path, work, said, verbose):
    code = f"""
import sys
import rollcli.run.estimate
rollcli.run.estimate.make_plan = lambda options: {work}
sys.argv = ["rollcli", "estimate", ".", *{verbose}]
from rollcli.__main__ import main
main()
"""
    done = python(code, cwd=tmp_path)
    assert done.returncode == 1
    first, *rest = done.stderr.splitlines()
    assert first.startswith("rollcli: internal error, please report it: ")
    assert said in first
    assert "<string>:4)" in first
    assert ("Traceback" in done.stderr) == bool(rest) == bool(verbose)
    assert not rest or any("run_estimate" in each for each in rest)


ATTRIBUTE = """
class Interrupted:
    def __set_name__(self, owner, name):
        raise KeyboardInterrupt

rollcli.cli.main.main = lambda **_: type("Owner", (), {"name": Interrupted()})
"""
MODULE = 'rollcli.cli.main.main = lambda **_: exec("raise KeyboardInterrupt")\n'


# without a standard output Python has none
@pytest.mark.parametrize("code", [ATTRIBUTE, MODULE, f"import sys; sys.stdout = None\n{MODULE}"])
def test_an_interrupt_while_a_module_loads_or_an_attribute_learns_its_name_is_status_130(tmp_path, code):
    code = f"import rollcli.cli.main\n{code}\nfrom rollcli.__main__ import main\nmain()"
    done = python(code, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (130, "rollcli: interrupted\n")


def test_signals_are_met_before_anything_is_imported_that_python_has_not(tmp_path):
    code = """
import sys
before = set(sys.modules)
import rollcli.__main__
print(sorted(set(sys.modules) - before))
"""
    done = python(code, cwd=tmp_path, check=True)
    assert done.stdout == "['rollcli', 'rollcli.__main__']\n"


@pytest.mark.parametrize(
    ("number", "module"),
    [
        ("SIGINT", "rollcli.run.workers.interrupt"),  # where Python's own handler is still in place
        *itertools.product(("SIGINT", "SIGTERM"), ("rollcli.messages", "rollcli.cli.main", "click")),
    ],
)
def test_a_signal_while_the_program_is_imported_is_one_line(tmp_path, number, module):
    code = f"""
import _signal
import sys

class Strike:
    def find_spec(name, path=None, target=None):
        if name == {module!r} and sys.meta_path[0] is Strike:
            sys.meta_path.remove(Strike)
            _signal.raise_signal(_signal.{number})

sys.meta_path.insert(0, Strike)
sys.argv = ["rollcli", "--version"]
from rollcli.__main__ import main
main()
"""
    done = python(code, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "rollcli: interrupted\n")


OF_OTHER_PROGRAMS = dict.fromkeys(("MPLBACKEND", "SOURCE_DATE_EPOCH", "OPENCV_IO_MAX_IMAGE_PIXELS"), "none")
OF_OTHER_PROGRAMS["OPENCV_LOG_LEVEL"] = "DEBUG"
WATCH_NUMPY = """
import os, sys

class Watch:
    def find_spec(name, path=None, target=None):
        if name == "numpy":
            print("threads:", os.environ.get("OPENBLAS_NUM_THREADS"))

sys.meta_path.insert(0, Watch)
from rollcli.cli.main import main
main()
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ("estimate", "maps", "-q", "-j1", "-o", "rolls.csv"),
        ("derotate", "maps", "--roll", "1", "-o", "up", "-j1"),
        pytest.param(("vdisparity", "maps", "--figure", "pdf", "-o", "v", "-j1"), marks=pytest.mark.slow),
        ("rig", "none.csv"),
        ("report", "none.csv"),
        ("simulate", "out", "--frames", "1", "--size", "64x48", "-j1"),
        ("evaluate", "accuracy", "none.csv", "--truth", "none.csv"),
        pytest.param(("evaluate", "paper", "maps", "-o", "out"), marks=pytest.mark.slow),
    ],
)
def test_linear_algebra_has_one_thread_and_libraries_no_settings_of_other_programs(tmp_path, arguments):
    write_maps(tmp_path / "maps", 1)
    variables = {name: text for name, text in environment().items() if not name.endswith("_NUM_THREADS")}
    done = python(WATCH_NUMPY, *arguments, cwd=tmp_path, env=variables | OF_OTHER_PROGRAMS)
    assert {*done.stdout.splitlines()} == {"threads: 1"}, done.stderr
    assert done.returncode == 2 * ("none.csv" in arguments), done.stderr
