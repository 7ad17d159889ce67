"""The wheel and the source distribution install and run; what keeps the project in order agrees."""

import email
import os
import re
import shutil
import sys
import tarfile
import zipfile

import pytest
import yaml

from rollcli.errors import UsageError
from rollcli.extras import EXTRAS, require_extra
from tests.files.recordings.small_bags import mcap
from tests.run_cli import ROOT, contents, ended, error_of, python, rollcli

ACTION = yaml.safe_load((ROOT / ".github" / "action" / "action.yml").read_text("utf-8"))
SAMPLES = ROOT / "sample_data"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder with wheel and source distribution, as `python -m build` makes them."""
    pytest.importorskip("build", reason="build, of what tests need, is not here")
    source = tmp_path_factory.mktemp("source")
    listed = ended(["git", "ls-files"], ROOT)
    if listed.returncode:
        pytest.skip("what belongs to the project is known from git, which this is no checkout of")
    for name in filter(None, listed.stdout.split("\n")):
        if (ROOT / name).exists():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, source / name)
    _run(sys.executable, "-m", "build", "--outdir", "dist", cwd=source)
    return source / "dist"


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """The folder of the programs of a fresh environment that has the wheel, and the extra for the page."""
    folder = tmp_path_factory.mktemp("fresh")
    _run(sys.executable, "-m", "venv", "environment", cwd=folder)
    (wheel,) = built.glob("*.whl")
    programs = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
    _run(str(programs / "python"), "-m", "pip", "install", "--quiet", f"{wheel}[report]", cwd=folder)
    return programs


def _run(*line, cwd, status=0, **variables):
    """Run a line; where the package index cannot be reached, skip."""
    kept = {name: each for name, each in os.environ.items() if not name.startswith("PYTHON")}
    done = ended(line, cwd, env={**kept, **variables}, timeout=900)
    if re.search(r"Could not find a version|Connection|ProxyError", done.stdout + done.stderr):
        pytest.skip("the package index cannot be reached")
    assert done.returncode == status, done.stdout + done.stderr
    return done


@pytest.mark.slow
def test_the_source_distribution_holds_tests_and_samples(built):
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        names = {name.partition("/")[2] for name in opened.getnames()}
    for wanted in ("LICENSE", "Makefile", ".ci/run", "tests/run_cli.py", "tests/cli/mistakes.txt"):
        assert wanted in names
    for folder in ("tests", "sample_data", "rollcli"):
        listed = ended(["git", "ls-files", folder], ROOT, check=True)
        assert set(listed.stdout.split()) <= names
    assert not any(name.endswith(".pyc") or name.startswith("out/") for name in names)


@pytest.mark.slow
def test_the_wheel_holds_the_program_alone_and_says_what_it_is(built):
    (archive,) = built.glob("*.whl")
    with zipfile.ZipFile(archive) as opened:
        names = opened.namelist()
        (place,) = (name for name in names if name.endswith("dist-info/METADATA"))
        metadata = email.message_from_bytes(opened.read(place))
    tops = {name.partition("/")[0] for name in names}
    assert tops == {"rollcli", place.partition("/")[0]}
    assert {"rollcli/py.typed", "rollcli/report/templates/report.html"} <= set(names)
    assert metadata["License-Expression"] == "MIT"
    assert metadata["License-File"] == "LICENSE"
    assert metadata["Author"]
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert "dev" not in metadata.get_all("Provides-Extra")
    shown = metadata.get_payload()
    assert "## Install" in shown
    assert re.findall(r"\]\((?!https://)[^)]*\)", shown) == []  # links that lead nowhere on an index
    assert len(shown.split()) > 0.8 * len((ROOT / "README.md").read_text("utf-8").split())


@pytest.mark.slow
def test_the_wheel_runs_in_a_fresh_environment(installed, tmp_path):
    program = str(installed / "rollcli")
    assert _run(program, "--version", cwd=tmp_path).stdout.startswith("rollcli")
    _run(program, "estimate", str(SAMPLES / "maps"), "-o", "rolls.csv", cwd=tmp_path)
    assert (tmp_path / "rolls.csv").read_text("utf-8").count(",ok,") == 5
    _run(program, "report", "rolls.csv", "-o", "rolls.html", cwd=tmp_path)
    assert "frame_0004.npy" in (tmp_path / "rolls.html").read_text("utf-8")
    client = "import rollcli, sys; print(rollcli.estimate_roll(rollcli.read_disparity(sys.argv[1])).roll_deg)"
    frame = str(SAMPLES / "maps" / "frame_0001.png")
    told = _run(str(installed / "python"), "-c", client, frame, cwd=tmp_path)
    assert float(told.stdout) == pytest.approx(-8, abs=0.1)


def steps(names, given, programs, cwd, status=0):
    """Run steps of the action in a shell, as its host would."""
    inputs = {name: str(each["default"]) for name, each in ACTION["inputs"].items()} | given
    last = None
    for name in names:
        (step,) = (each for each in ACTION["runs"]["steps"] if each.get("name") == name)
        variables = {
            key: re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda found: inputs[found[1]], value)
            for key, value in step["env"].items()
        }
        variables["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"
        expected = status if name == names[-1] else 0
        script = step["run"]
        last = _run("bash", "-e", "-o", "pipefail", "-c", script, cwd=cwd, status=expected, **variables)
    return last


needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
PROGRAMS = os.path.dirname(sys.executable)  # noqa: PTH120


@needs_bash
@pytest.mark.slow
def test_the_action_estimates_makes_the_page_and_checks(tmp_path):
    pytest.importorskip("plotly", reason="plotly, of the extra report, is not here")
    given = {"maps": str(SAMPLES / "maps"), "calib": str(SAMPLES / "calib.txt"), "untold": "pass"}
    done = steps(["estimate", "page", "check"], given, PROGRAMS, tmp_path)
    assert "frame_0001" in (tmp_path / "rollcli" / "rolls.html").read_text("utf-8")
    assert "5" in done.stdout
    assert ",ok," in (tmp_path / "rollcli" / "rolls.csv").read_text("utf-8")


@needs_bash
@pytest.mark.slow
def test_the_actions_check_fails_a_rig_that_is_not_as_asked(tmp_path):
    given = {"maps": str(SAMPLES / "maps"), "estimate": "--roi=0,0,2,2"}
    steps(["estimate", "check"], given, PROGRAMS, tmp_path, status=4)


@needs_bash
@pytest.mark.slow
def test_the_action_takes_pairs_and_options_with_spaces(tmp_path):
    views = tmp_path / "two views"
    for side in ("left", "right"):
        (views / side).mkdir(parents=True)
        shutil.copy(SAMPLES / side / "frame_0001.png", views / side)
    given = {"left": "two views/left", "right": "two views/right", "estimate": "--max-roll=30\n--timing"}
    steps(["estimate"], given, PROGRAMS, tmp_path)
    rows = (tmp_path / "rollcli" / "rolls.csv").read_text("utf-8").splitlines()
    assert rows[0].endswith("elapsed_ms")
    assert "two views/left/frame_0001.png" in rows[1]


def test_the_workflow_uses_the_action_with_inputs_that_it_has():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "action.yml").read_text("utf-8"))["jobs"]
    (step,) = (each for each in jobs["sample"]["steps"] if each["uses"] == "./.github/action")
    assert set(step["with"]) <= set(ACTION["inputs"])
    assert (ROOT / step["with"]["maps"]).is_dir()
    for each in ACTION["runs"]["steps"]:  # what is given never becomes part of a script
        assert "${{" not in each.get("run", "")


def test_the_container_copies_what_is_there_and_is_not_root():
    text = (ROOT / ".github" / "Dockerfile").read_text("utf-8")
    allowed = (ROOT / ".github" / "Dockerfile.dockerignore").read_text("utf-8")
    for name in re.findall(r"^!(.*)", allowed, flags=re.M):
        assert (ROOT / name).exists()
    (user,) = re.findall(r"^USER (\d+)", text, flags=re.M)
    assert int(user) > 0


def test_only_the_packages_that_are_missing_are_to_be_installed(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)
    said = error_of(UsageError, require_extra, "report", "the page")
    assert said == f"the page needs the extra report: {sys.executable} -m pip install plotly"


def test_a_program_that_pipx_installed_is_extended_by_pipx(monkeypatch, tmp_path):
    (tmp_path / "pipx_metadata.json").write_text("{}")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    for name in ("dask", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match=r"the extra cluster: pipx inject rollcli dask distributed$"):
        require_extra("cluster", "--scheduler")


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
    assert python("import sys, tests.conftest; sys.exit('numpy' in sys.modules)", cwd=ROOT).returncode == 0


FRAMES = 1


@pytest.mark.parametrize(
    ("line", "missing", "said"),
    [
        *(("evaluate paper maps -o out", each, "the extra report") for each in EXTRAS["report"]),
        ("vdisparity maps --figure pdf -o v", "matplotlib", "rollcli: --figure needs the extra report"),
        ("estimate s3://maps/a.png", "obstore", "needs the extra storage"),
        ("estimate s3://maps/", "obstore", "needs the extra storage"),
        ("estimate drive.mcap", "rosbags", "drive.mcap needs the extra bags"),
    ],
)
def test_what_an_extra_does_is_refused_before_any_work_with_what_to_install(
    maps, monkeypatch, line, missing, said
):
    (maps / "drive.mcap").write_bytes(mcap())
    before = contents(maps)
    monkeypatch.setitem(sys.modules, missing, None)
    refusal = rollcli(*line.split(), cwd=maps).refused()
    assert refusal.endswith(f"{said}: {sys.executable} -m pip install {missing}\n")
    assert contents(maps) == before
