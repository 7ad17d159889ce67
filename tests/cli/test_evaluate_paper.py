"""`rollcli evaluate paper` as a user runs it."""

import re
import shutil

import numpy as np
import pytest

from rollcli.evaluate import paper as job
from rollcli.evaluate.paper import PAGE, TABLES
from rollcli.run.workers import tasks as run_tasks
from tests.estimator.synthetic_maps import bent_road
from tests.run_cli import contents, interrupt_in, rollcli, rows_of

pytestmark = pytest.mark.slow

FAST = ("--turns", "-8:8:8", "--timed", "1")

for each in ("plotly", "jinja2", "matplotlib"):
    pytest.importorskip(each, reason="the extra `report` is not installed")


def write_maps(folder, *names):
    folder.mkdir()
    for k, name in enumerate(names):
        np.save(folder / name, bent_road(2 * k - 3, width=160, height=120, noise=0.1).astype(np.float32))


def paper(folder, *arguments):
    return rollcli("evaluate", "paper", "maps", "-o", "out", *FAST, *arguments, cwd=folder)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper")
    write_maps(folder / "maps", "a.npy", "b.npy", "<script>alert(1)<script>.npy")
    (folder / "maps/empty.npy").write_bytes(b"")
    assert paper(folder, "-j1").status == 3
    return folder


@pytest.mark.parametrize("kind", ["svg", "pdf"])
def test_each_chart_is_a_figure_as_wide_as_a_column_too(tmp_path, kind):
    write_maps(tmp_path / "maps", "a.npy")
    assert paper(tmp_path, "--figure", kind, "-q").status == 0
    figures = {name: data for name, data in contents(tmp_path / "out").items() if name.endswith(kind)}
    assert sorted(figures) == sorted(f"{name}.{kind}" for name in TABLES[1:])
    width = {"svg": b'width="252pt"', "pdf": b"/MediaBox [ 0 0 252 "}[kind]
    assert all(width in data for data in figures.values())


def test_the_page_needs_no_network_names_what_failed_and_shows_file_names_as_text(done):
    page = (done / "out" / PAGE).read_text()
    assert "maps/empty.npy: " in page
    assert not re.search(r'<(script|link|img|iframe)[^>]+(src|href)="?(https?:)?//', page)
    assert "&lt;script&gt;alert(1)" in page
    assert "<script>alert(1)" not in page
    assert page.count('<svg class="still wide-screen"') == 5
    assert "<script" not in page


def test_the_tables_do_not_depend_on_the_workers(done, tmp_path):
    shutil.copytree(done / "maps", tmp_path / "maps")
    paper(tmp_path, "-j2", "-q")
    for name in set(TABLES) - {"table2_runtime"}:
        assert (tmp_path / f"out/{name}.csv").read_bytes() == (done / f"out/{name}.csv").read_bytes()


def test_every_chart_is_drawn_in_a_browser_without_an_error(done, open_page):
    page = open_page((done / "out" / PAGE).as_uri())
    for each in range(5):
        page.locator(".chart").nth(each).locator(".wide-screen").wait_for()
    assert page.locator(".chart").count() == 5


def test_pixels_outside_of_the_region_count_for_nothing(tmp_path):
    write_maps(tmp_path / "maps", "a.npy")
    values = np.load(tmp_path / "maps/a.npy")
    values[:, :40] = 7  # a car beside the road
    np.save(tmp_path / "maps/a.npy", values)
    (tmp_path / "truth.csv").write_text("file,roll_deg\na,-3\n")
    corners = "45,0 159,0 159,119 45,119"
    assert paper(tmp_path, "--truth", "truth.csv", "--polygon", corners, "-q").status == 0
    rows = rows_of((tmp_path / "out/fig6_accuracy.csv").read_text())
    exact = [row for row in rows if row["solver"] == "exact"]
    assert float(exact[0]["mean_deg"]) == pytest.approx(0, abs=0.05)


def test_errors_that_hardly_differ_have_a_scale(tmp_path):
    write_maps(tmp_path / "maps", "a.npy")
    (tmp_path / "truth.csv").write_text("file,roll_deg\na,-3.5\n")
    assert paper(tmp_path, "--truth", "truth.csv", "--figure", "svg", "-q").status == 0
    for name in ("fig6_accuracy", "methods_accuracy"):
        drawn = (tmp_path / f"out/{name}.svg").read_text()
        assert ">0.1°<" in drawn
        assert ">1°<" in drawn


def test_an_interrupted_evaluation_writes_nothing(tmp_path, monkeypatch):
    write_maps(tmp_path / "maps", "a.npy", "b.npy")
    interrupt_in(monkeypatch, job, "examine_file")
    monkeypatch.setattr(run_tasks, "_usable_processors", lambda: 1)
    run = paper(tmp_path)
    assert run.status == 130
    assert "interrupted after 1 of 2 maps; nothing is written" in run.err
    assert not (tmp_path / "out").exists()
