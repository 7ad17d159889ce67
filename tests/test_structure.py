"""The arrows between packages run one way, and no modules import each other in a circle."""

import ast
import functools
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter

from tests.run_cli import ROOT

PACKAGE = ROOT / "rollcli"
# a package may import those of its own layer, without a circle, and those of the layers below it
LAYERS = (
    {"cli"},
    {"simulate", "evaluate", "report"},
    {"run"},
    {"pictures", "stereo", "files", "rig"},
    {"estimator"},
    {"errors", "extras", "messages"},
)
# modules that import something of rollcli inside a function, and why
DOORS = {
    "rollcli": "names load when they are first used, so that `import rollcli` costs nothing",
    "rollcli.__main__": "a worker process imports it anew, and a signal during imports is one line",
    "rollcli.evaluate.paper": "loads the page and its charts, an extra, once there is something to draw",
    "rollcli.files.containers": "loads the reader of bags, an extra, and NumPy only for bags",
    "rollcli.run.find": "loads the reader of bags, an extra, only for them, and NumPy for an image's size",
    "rollcli.files.storage": "urllib loads only for URLs of web servers",
    "rollcli.report.run": "loads the page and its figures, an extra, once the request is checked",
    "rollcli.run.frame_task": "matplotlib, an extra, loads only for figures",
    "rollcli.run.batch": "a worker's door; decodes videos in place of workers, which loads OpenCV",
    "rollcli.run.library": "loads the readers of recordings only for them",
    "rollcli.run.options": "the command line's help needs no URLs",
    "rollcli.run.read": "loads OpenCV's matcher only for pairs",
    "rollcli.run.convert": "estimates maps, which loads NumPy, only of other folders than the rows'",
    "rollcli.run.progress": "loads NumPy only at the end of a run, to tell the rig's roll",
    "rollcli.run.workers.pool": "a worker's door",
    "rollcli.run.workers.tasks": "loads the executor that is used; the cluster is an extra",
    "rollcli.stereo.correction": "the command line's help needs no files",
}
DOOR_PACKAGES = {"rollcli.cli": "the command line's doors: help and version load no command"}
# what is filled in while it is made
CHANGING = {
    "rollcli.files.recordings.frames.BagFrames",
    "rollcli.files.search.Search",
    "rollcli.simulate.scene.Scene",
}


def modules():
    """Every module by its dotted name."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


MODULES = dict(modules())


@functools.cache
def imports(name, *, in_functions):
    """The modules of rollcli that a module imports: when it is loaded, or inside its functions."""
    return tuple(_imports(_tree(name), in_function=False, wanted=in_functions))


def every_import(name):
    return {*imports(name, in_functions=False), *imports(name, in_functions=True)}


@functools.cache
def _tree(name):
    return ast.parse(MODULES[name].read_text("utf-8"))


def _imports(node, *, in_function, wanted):
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            continue  # never loaded
        if not isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            continue  # an expression imports nothing
        if in_function is wanted and isinstance(child, ast.ImportFrom):
            full = [f"{child.module}.{alias.name}" for alias in child.names]
            yield from (each if each in MODULES else child.module for each in full if ours(each))
        elif in_function is wanted and isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names if ours(alias.name))
        is_function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
        yield from _imports(child, in_function=in_function or is_function, wanted=wanted)


def ours(name):
    return name.split(".")[0] == "rollcli"


def layer(name):
    """The position of a module's package, from the command line down; None for the package itself."""
    parts = name.split(".")
    if len(parts) < 2 or parts[1] == "__main__":
        return None
    (found,) = (index for index, packages in enumerate(LAYERS) if parts[1] in packages)
    return found


def test_no_module_imports_upwards():
    upwards = [
        f"{name} -> {each}"
        for name in MODULES
        for each in sorted(every_import(name))
        if None not in (layer(name), layer(each)) and layer(each) < layer(name)
    ]
    assert upwards == []


def sorted_or_circle(graph):
    """Nothing, or the circle that a graph holds."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return None


def test_no_modules_import_each_other_in_a_circle():
    graph = {name: every_import(name) - {name, "rollcli"} for name in MODULES}
    assert sorted_or_circle(graph) is None


def test_no_packages_import_each_other_in_a_circle():
    graph = defaultdict(set)
    for name in MODULES:
        for each in every_import(name):
            if None not in (layer(name), layer(each)) and name.split(".")[1] != each.split(".")[1]:
                graph[name.split(".")[1]].add(each.split(".")[1])
    assert sorted_or_circle(graph) is None


def test_imports_inside_functions_are_at_doors_alone():
    found = {name for name in MODULES if any(imports(name, in_functions=True))}
    unexplained = found - DOORS.keys()
    unexplained -= {name for name in found if ".".join(name.split(".")[:2]) in DOOR_PACKAGES}
    assert unexplained == set()
    assert DOORS.keys() - found - {"rollcli"} == set()


def test_no_module_defers_its_annotations():
    deferring = {name for name, path in MODULES.items() if "from __future__" in path.read_text("utf-8")}
    assert deferring == set()


def test_a_record_does_not_change_once_it_is_made():
    changing = {
        f"{name}.{node.name}"
        for name in MODULES
        for node in ast.walk(_tree(name))
        if isinstance(node, ast.ClassDef)
        for each in map(ast.unparse, node.decorator_list)
        if each.partition("(")[0] == "dataclass" and "frozen=True" not in each
    }
    assert changing == CHANGING
