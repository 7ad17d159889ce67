"""Change the program in one place at a time, and see whether its tests notice.

``python -m tests.fuzz.mutants [--count 15] [--seed 1] [PACKAGE ...]``: so many changes of each package, drawn
at random and each tried with the tests that belong to the package, which end at the first failure. What lives
either changes nothing that anyone could see, or a test is missing. What dies is listed with the test that
failed: on a busy machine one that waits for a browser or a network may fail for another reason.

All is read from one copy of the sources, and the tests must pass there before anything is changed. So a
change is noticed when a test fails, and also when the tests cannot even be collected: that worked before.
Whatever else pytest ends with tells nothing about the change, and stops the whole.
"""

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM, TESTS = "rollcli", "tests"
# the tests of a package beyond the folder of its name, the quickest first
FURTHER = {
    "cli": "run/test_recorded run/test_resume test_messages test_readme",
    "estimator": "rig/test_pose rig/test_recorded",
    "evaluate": (
        "cli/test_recorded cli/test_mistakes cli/test_evaluate_paper cli/test_outputs cli/test_heights "
        "estimator/test_energy estimator/solvers test_package"
    ),
    "files": (
        "run/test_recorded cli/test_recorded run/test_update run/test_resume run/test_retry_failed "
        "run/test_two_runs run/test_result_parts cli/test_frames cli/test_outputs cli/test_help "
        "cli/test_urls cli/test_buckets cli/test_bad_stores pictures/test_recorded"
    ),
    "pictures": "run/test_recorded run/test_derotate run/test_vdisparity cli/test_heights",
    "rig": "cli/test_recorded cli/test_calibration run/test_diagnosis",
    "run": (
        "cli/test_recorded files/stores/test_turns cli/test_mistakes cli/test_outputs cli/test_help "
        "cli/test_frames cli/test_calibration cli/test_lost_readers cli/test_bad_stores cli/test_urls "
        "cli/test_buckets cli/test_rig_pairs files/recordings/test_bags files/recordings/test_video"
    ),
    "simulate": (
        "cli/test_recorded cli/test_mistakes cli/test_simulate cli/test_outputs cli/test_lost_readers "
        "stereo/test_alignment stereo/test_stereo"
    ),
    "report": "cli/test_recorded cli/test_mistakes cli/test_outputs",
    "stereo": "run/test_recorded run/test_estimate_pair test_python",
}
_QUICKLY = ("-x", "-q", "-p", "no:cacheprovider")
_NOTICED = (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED, pytest.ExitCode.USAGE_ERROR)
_FAILURES = ("FAILED ", "ERROR ", "ImportError while loading conftest ")
_SECONDS = 600  # a change may make an endless loop

_PAIRS = ((ast.Lt, ast.LtE), (ast.Gt, ast.GtE), (ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn))
_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    one: other for pair in _PAIRS for one, other in (pair, pair[::-1])
}
_OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Div,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
# what a right program does the same without: a check of lengths that are equal, dictionaries of instances, a
# copy of what nobody writes to, and a cache of another size of what depends on its arguments alone
_ALIKE = {"zip": "strict", "dataclass": "slots", "astype": "copy", "lru_cache": "maxsize"}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "minimum": "maximum", "maximum": "minimum"}


class Mutant(NamedTuple):
    """One change: the file below the root, the line, what stood there, and the whole changed source."""

    path: Path
    line: int
    change: str
    source: str


def mutants(tree: Path, path: Path) -> Iterator[Callable[[], Mutant]]:
    """Yield every change of a file below the root, each to be made when it is wanted."""
    module = ast.parse((tree / path).read_text("utf-8"))
    alike = {id(node) for each in ast.walk(module) for node in _alike(each)}
    for place, node in enumerate(ast.walk(module)):
        for number in range(0 if id(node) in alike else len(_changes(node))):
            yield lambda place=place, number=number: _mutant(path, module, place, number)


def _alike(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what no program shows, if it is changed; imports that only annotations use are such, too."""
    if isinstance(node, ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        yield from (each.value for each in node.keywords if each.arg and _ALIKE.get(name) == each.arg)
    elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        yield node


def _mutant(path: Path, module: ast.Module, place: int, number: int) -> Mutant:
    changed = copy.deepcopy(module)
    node = list(ast.walk(changed))[place]
    before = ast.unparse(node)
    _changes(node)[number]()
    line = getattr(node, "lineno", 0)
    return Mutant(path, line, f"{before}  ->  {ast.unparse(node)}", ast.unparse(changed))


def _changes(node: ast.AST) -> list[Callable[[], None]]:
    """List what can be changed in a node; annotations and texts are left alone."""
    if isinstance(node, ast.Compare):
        swaps = [(place, _COMPARISONS.get(type(each))) for place, each in enumerate(node.ops)]
        return [_setter(node.ops, place, other()) for place, other in swaps if other]
    if isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in _OPERATORS:
        if isinstance(node.op, ast.BitOr) and isinstance(node, ast.BinOp) and _is_type(node):
            return []
        return [_attribute(node, "op", _OPERATORS[type(node.op)]())]
    if isinstance(node, ast.BoolOp):
        return [_attribute(node, "op", ast.Or() if isinstance(node.op, ast.And) else ast.And())]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return [_attribute(node, "op", ast.UAdd())]
    if isinstance(node, ast.If | ast.IfExp | ast.While):
        return [_attribute(node, "test", ast.UnaryOp(ast.Not(), node.test))]
    if isinstance(node, ast.Constant):
        return _of_constant(node)
    if isinstance(node, ast.Name) and node.id in _NAMES:
        return [_attribute(node, "id", _NAMES[node.id])]
    if isinstance(node, ast.Attribute) and node.attr in _NAMES:
        return [_attribute(node, "attr", _NAMES[node.attr])]
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call | ast.YieldFrom):
        return [_attribute(node, "value", ast.Constant(None))]
    return []


def _of_constant(node: ast.Constant) -> list[Callable[[], None]]:
    value = node.value
    if isinstance(value, bool):
        return [_attribute(node, "value", not value)]
    if isinstance(value, int):
        return [_attribute(node, "value", value + 1)]
    return [_attribute(node, "value", value * 1.5 + 0.1)] if isinstance(value, float) else []


def _is_type(node: ast.expr) -> bool:
    """Tell `int | None`, which Python only reads, from arithmetic."""
    if isinstance(node, ast.BinOp):
        return _is_type(node.left) or _is_type(node.right)
    names = {"None", "NoneType", "str", "int", "float", "Path", "bytes", "Any"}
    return ast.unparse(node) in names or ast.unparse(node).endswith(("]", "Error"))


def _attribute(node: ast.AST, name: str, value: object) -> Callable[[], None]:
    return lambda: setattr(node, name, value)


def _setter(items: list[ast.cmpop], place: int, value: ast.cmpop) -> Callable[[], None]:
    return lambda: items.__setitem__(place, value)


def further(tree: Path, package: str) -> list[Path]:
    """List the files and folders of tests of a package beyond the folder of its name."""
    named = [tree / TESTS / each for each in FURTHER.get(package, "").split()]
    return [each if each.is_dir() else each.with_suffix(".py") for each in named]


def tests_of(tree: Path, path: Path) -> list[str]:
    """List the test files to try, first the record, then those named after the module, or that import it."""
    package, name = path.parts[1], path.with_suffix("").as_posix().replace("/", ".")
    places = [tree / TESTS / package, *further(tree, package), tree / TESTS / "test_structure.py"]
    files = [
        file for place in places for file in ([place] if place.suffix else sorted(place.rglob("test_*.py")))
    ]

    def distance(file: Path) -> int:
        if file.stem == "test_recorded":
            return -1
        if file.stem == f"test_{path.stem}":
            return 0
        return 1 if name in file.read_text("utf-8") else 2

    return [str(file.relative_to(tree)) for file in sorted(dict.fromkeys(files), key=distance)]


def failure(tree: Path, files: Sequence[str]) -> str:
    """Run the tests of the copy; name the one that fails, or cannot be collected; empty when none does."""
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *_QUICKLY, *files],
            cwd=tree,
            env={**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no end in {_SECONDS} s"
    if done.returncode == pytest.ExitCode.OK:
        return ""
    # what cannot be imported has a line ERROR; with a conftest pytest calls it wrong usage
    # a change may raise what only a signal should; the user's own Ctrl-C ends this process too
    said = [
        line
        for line in done.stdout.splitlines()
        if line.startswith(_FAILURES) or line.endswith(": KeyboardInterrupt")
    ]
    if said and done.returncode in _NOTICED:
        return said[0].partition(" - ")[0]
    sys.exit(f"{done.stdout}\npytest ended with {done.returncode}: the tests neither passed nor failed")


def noticed(mutant: Mutant, tree: Path) -> str:
    """Name the test that fails on the changed program; empty when none does."""
    target = tree / mutant.path
    whole = target.read_bytes()
    target.write_text(mutant.source, "utf-8")
    try:
        return failure(tree, tests_of(tree, mutant.path))
    finally:
        target.write_bytes(whole)


def main(arguments: Sequence[str] | None = None) -> None:
    """Try the changes, and print a line for each, and one for each package."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("packages", nargs="*", help="of rollcli (all)")
    parser.add_argument("--count", type=int, default=15)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(
            ROOT,
            tree,
            ignore=shutil.ignore_patterns(".git", ".venv", ".*cache*", "out", "*.egg-info", "__pycache__"),
        )
        if (ROOT.parent / "shared").exists():
            (tree.parent / "shared").symlink_to((ROOT.parent / "shared").resolve())
        every = sorted(path.parent.name for path in (tree / PROGRAM).glob("*/__init__.py"))
        for unknown in set(given.packages) - set(every):
            parser.error(f"no package of {PROGRAM}: {unknown}")
        for lost in (each for package in FURTHER for each in further(tree, package) if not each.exists()):
            parser.error(f"FURTHER names tests that are not there: {lost}")
        for package in given.packages or every:
            modules = sorted(path.relative_to(tree) for path in (tree / PROGRAM / package).rglob("*.py"))
            said = failure(tree, tests_of(tree, modules[0]))
            if said:
                sys.exit(f"{package}: its tests fail before anything is changed: {said}")
            places = [make for path in modules for make in mutants(tree, path)]
            drawn = random.Random(f"{given.seed} {package}").sample(places, min(given.count, len(places)))
            start, killed = time.monotonic(), 0
            for make in drawn:
                mutant = make()
                said = noticed(mutant, tree)
                killed += bool(said)
                print(f"  {said or 'lives'}: {mutant.path}:{mutant.line}: {mutant.change}", flush=True)
            seconds = time.monotonic() - start
            print(f"{package}: {len(drawn)} tried, {killed} killed, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
