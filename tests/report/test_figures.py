"""Charts as files and as pictures of a page, drawn by matplotlib."""

import re
import xml.etree.ElementTree as ET

import cv2
import matplotlib as mpl
import numpy as np
import pytest

from rollcli.pictures.colours import DARK, LIGHT, style_sheet
from rollcli.pictures.figures import SLIDE
from rollcli.report import figures
from rollcli.report.charts import all_charts
from rollcli.report.figures import chart_file, stills
from rollcli.rig.drive.assess import assess_rig
from tests.report.results import OF_ONE_KIND, row
from tests.slow import mostly_slow

SVG = "{http://www.w3.org/2000/svg}"


def drive(frames=400):
    """A drive with a jump, suspect and failed frames."""
    rng = np.random.default_rng(5)
    rows = [row(f"{i}.png", float(r), 0.05) for i, r in enumerate(rng.normal(0.3, 0.05, frames))]
    rows[200:] = [row(each.file, each.roll_deg + 1.0, 0.05) for each in rows[200:]]
    rows[40:60] = [row(each.file, 0.9, 0.4, "suspect") for each in rows[40:60]]
    rows[300] = row("300.png", None)
    return rows


@pytest.fixture(scope="module")
def charts():
    return all_charts(drive(), assess_rig(drive()))


def decoded(data):
    """A PNG as an array, RGB."""
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def of_colour(shown, name):
    """Where a picture has a colour, give or take what blending leaves."""
    return np.abs(shown.astype(int) - [*bytes.fromhex(LIGHT[name])]).max(axis=2) < 12


def drawn(rows, name="roll"):
    return decoded(chart_file(all_charts(rows, assess_rig(rows))[name], "png"))


@pytest.mark.parametrize(
    ("name", "begins", "words"),
    [
        ("roll", "Roll in degrees", ["frame", "95 % interval", "suspect", "failed", "jump", "mounting"]),
        ("histogram", "How many", ["frames", "ok", "suspect"]),
    ],
)
def test_an_svg_has_the_size_of_a_slide_a_title_axes_with_units_and_a_legend(charts, name, begins, words):
    root = ET.fromstring(chart_file(charts[name], "svg"))
    assert (root.get("width"), root.get("height")) == ("960pt", "420pt")
    assert next(root.iter("{http://purl.org/dc/elements/1.1/}title")).text.startswith(begins)
    texts = [each.text for each in root.iter(f"{SVG}text")]
    assert [each for each in ("roll, degrees", *words) if each not in texts] == []


def test_a_pdf_has_the_same_size_and_its_letters_are_letters(charts):
    pdf = chart_file(charts["roll"], "pdf")
    assert pdf.startswith(b"%PDF")
    assert re.search(rb"/MediaBox \[ 0 0 960 420 \]", pdf)
    assert b"/FontFile2" in pdf
    assert b"/CreationDate" not in pdf


def test_a_value_lies_where_the_axes_say():
    shown = drawn([row("a.png", 1.0, None), row("b.png", 3.0, None), row("c.png", 1.0, None)])
    rows, columns = np.nonzero(of_colour(shown, "c1")[100:])  # below the legend
    dot = 8 * SLIDE.font / 13 * 2  # pixels of its width
    left, right = columns.min() + dot / 2, columns.max() - dot / 2
    # the lines behind the values name frames 1, 2 and 3
    grid = np.flatnonzero(of_colour(shown, "grid")[150:600].mean(axis=0) > 0.9)
    lines = [part.mean() for part in np.split(grid, np.flatnonzero(np.diff(grid) > 1) + 1)]
    assert [left, right] == pytest.approx([lines[0], lines[-1]], abs=2)
    top = columns[rows == rows.min()].mean()
    assert top == pytest.approx(lines[len(lines) // 2], abs=2)


def test_nothing_of_a_files_name_is_in_a_chart():
    rows = [row("]]><script>alert(1)</script>.png", 1.0), row("b.png", None, message="<img onerror=1>")]
    for chart in all_charts(rows, assess_rig(rows)).values():
        for text in (chart_file(chart, "svg").decode(), stills(chart)):
            assert "alert" not in text
            assert "onerror" not in text


@pytest.mark.slow
def test_of_many_frames_those_are_drawn_that_make_the_same_picture(monkeypatch):
    rng = np.random.default_rng(6)
    rows = [row(f"{i}.png", float(v), 0.2) for i, v in enumerate(rng.normal(0, 1, 20_000))]
    thinned, file = drawn(rows), chart_file(all_charts(rows, assess_rig(rows))["roll"], "svg")
    monkeypatch.setattr(figures, "_MOST_TO_KEEP", 10**9)
    whole = drawn(rows)
    assert np.mean(np.abs(thinned.astype(int) - whole).max(axis=2) > 40) < 0.01
    assert len(file) < 0.5 * len(chart_file(all_charts(rows, assess_rig(rows))["roll"], "svg"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["roll", "histogram"])
def test_a_browser_shows_the_svg_as_the_png_is(browser, tmp_path, charts, name):
    (tmp_path / "chart.svg").write_bytes(chart_file(charts[name], "svg"))
    page = browser.new_page(viewport={"width": 1280, "height": 560}, device_scale_factor=1.5)
    page.goto((tmp_path / "chart.svg").as_uri())
    data = page.screenshot()
    page.close()
    seen, made = decoded(data), decoded(chart_file(charts[name], "png"))
    assert seen.shape == made.shape == (840, 1920, 3)
    inner = np.s_[100:720, 120:1880]  # letters differ
    one, other = (cv2.blur(each[inner].astype(float), (15, 15)) for each in (seen, made))
    assert np.ptp(one) > 100
    assert np.abs(one - other).mean() < 0.02 * np.ptp(one)


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_files_are_the_same_each_time_whatever_a_user_has_set_and_leave_that_alone(charts, kind):
    one = chart_file(charts["roll"], kind)
    with mpl.rc_context({"font.size": 30.0, "axes.grid": False, "svg.fonttype": "path", "lines.marker": "x"}):
        before = dict(mpl.rcParams)
        assert chart_file(charts["roll"], kind) == one
        assert dict(mpl.rcParams) == before


MIXED = [row("a.png", 1.0, 0.1), row("b.png", -80.0, 20.0, "suspect"), row("c.png", 1.1, 0.1)]


@pytest.mark.parametrize("rows", mostly_slow([MIXED, *OF_ONE_KIND], MIXED))
def test_every_kind_of_result_has_charts(rows):
    for chart in all_charts(rows, assess_rig(rows)).values():
        for kind in ("svg", "pdf", "png"):
            assert len(chart_file(chart, kind)) > 1000


def test_on_a_page_a_chart_has_two_pictures_in_the_pages_colours_and_font(charts):
    still = "".join(stills(chart) for chart in charts.values())
    found = re.findall(r'<svg class="still (\S+)" viewBox="0 0 (\d+) (\d+)"', still)
    assert found == [("wide-screen", "1000", "368"), ("narrow-screen", "350", "352")] * 2
    assert "var(--c1)" in still
    for word in ("#2563c9", "<style", "font-family", "DejaVu", "font:"):
        assert word not in still
    named = re.findall(r'id="([^"]+)"', still)
    assert len(named) == len(set(named))
    assert {each[1:] for each in re.findall(r'(?<=href=")[^"]+|(?<=url\()[^)]+', still)} <= set(named)


def test_the_style_sheet_holds_every_colour_of_both_modes():
    light, dark = style_sheet().split("@media screen and (prefers-color-scheme: dark)")
    for sheet, colours in ((light, LIGHT), (dark, DARK)):
        found = dict(re.findall(r"--([\w-]+): #(\w+);", sheet))
        assert found == colours
    assert LIGHT.keys() == DARK.keys()
    # a picture tells colours by their digits: those of one kind are one colour in dark mode too
    pairs = {(LIGHT[name], DARK[name]) for name in LIGHT if name not in ("suspect-text", "card")}
    assert len(pairs) == len({light for light, _ in pairs})
