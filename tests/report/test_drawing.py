"""The charts of a report as SVG and PNG."""

import re
import xml.etree.ElementTree as ET

import cv2
import numpy as np
import pytest

from rollcli.report.charts import all_charts
from rollcli.report.colours import DARK, LIGHT, rgb
from rollcli.report.figures import Line, Sketch, Words, lay_out, png_file, svg_file
from rollcli.rig.drive.assess import assess_rig
from tests.report.results import row

SVG = "{http://www.w3.org/2000/svg}"


def drive(frames=400):
    """A drive with a jump, suspect and failed frames."""
    rng = np.random.default_rng(5)
    rows = [row(f"{i}.png", float(r), 0.05) for i, r in enumerate(rng.normal(0.3, 0.05, frames))]
    rows[200:] = [row(each.file, each.roll_deg + 1.0, 0.05) for each in rows[200:]]
    rows[40:60] = [row(each.file, 0.9, 0.4, "suspect") for each in rows[40:60]]
    rows[300] = row("300.png", None)
    return rows


def charts(rows):
    return all_charts(rows, assess_rig(rows))


def sketch(rows, name="roll"):
    return lay_out(charts(rows)[name], 1280, 560, 18.0)


@pytest.fixture(scope="module")
def sketches():
    """The charts of the drive, laid out."""
    return {name: lay_out(chart, 1280, 560, 18.0) for name, chart in charts(drive()).items()}


def decoded(data):
    """A PNG as an array, RGB."""
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def of_colour(shown, name):
    """Where a picture has a colour, give or take what blending leaves."""
    return np.abs(shown.astype(int) - rgb(name)).max(axis=2) < 12


def test_a_value_lies_where_the_axes_say():
    laid = lay_out(all_charts([row("a.png", 1.0, None), row("b.png", 3.0, None)])["roll"], 1000, 400)
    (line,) = [item for item in laid.inside if isinstance(item, Line) and item.colour == "c1"]
    _, _, width, height = laid.frame
    # the axes reach half a frame beyond the frames, and 6 % and 0.05 degrees beyond the values
    margin = (0.06 * 2 + 0.05) / (2 + 2 * (0.06 * 2 + 0.05))
    assert line.points[:, 0] == pytest.approx([0.25 * width, 0.75 * width])
    assert line.points[:, 1] == pytest.approx([(1 - margin) * height, margin * height], abs=0.2)


def test_of_the_lines_behind_the_values_that_of_zero_stands_out():
    laid = sketch([row("a.png", -1.0, None), row("b.png", 1.0, None)])
    behind = [item for item in laid.inside if isinstance(item, Line) and item.colour in ("line", "grid")]
    (zero,) = [item for item in behind if item.colour == "line"]
    _, _, width, height = laid.frame
    np.testing.assert_allclose(zero.points, [(0, height / 2), (width, height / 2)], atol=0.5)
    assert {item.width < zero.width for item in behind if item is not zero} == {True}


@pytest.mark.parametrize("anchor", ["start", "end"])  # the middle may lie between two pixels
def test_upright_words_are_those_of_a_line_turned(anchor):
    lying = Sketch("", 200, 80, 18.0, (0, 0, 10, 10), (), (Words(100, 40, "roll, degrees", "text", anchor),))
    words = Words(40, 200 - 100, "roll, degrees", "text", anchor, upright=True)
    upright = Sketch("", 80, 200, 18.0, (0, 0, 10, 10), (), (words,))
    shown = [decoded(png_file(each)).astype(int) for each in (lying, upright)]
    assert of_colour(shown[0], "text").any()
    assert np.abs(np.rot90(shown[0]) - shown[1]).max() <= 1


def test_axes_have_round_numbers_with_a_true_minus_and_thousands():
    rows = [row(f"{i}.png", -1 + 2 * i / 2500, 0.05) for i in range(2500)]
    texts = [item.text for item in sketch(rows).around if isinstance(item, Words)]
    assert {"−1", "0", "1", "1,000", "2,000", "frame", "roll, degrees"} <= {
        text.replace(".0", "") for text in texts
    }


@pytest.mark.parametrize("name", ["roll", "histogram"])
def test_an_svg_is_well_formed_and_its_lines_end_inside_of_it(sketches, name):
    root = ET.fromstring(svg_file(sketches[name]))
    assert (root.get("width"), root.get("height")) == ("1280", "560")
    begins = {"roll": "Roll in degrees", "histogram": "How many"}[name]
    assert root.find(f"{SVG}title").text.startswith(begins)
    named = [each.text for each in root.iter(f"{SVG}text")]
    expected = {"roll": ["suspect", "failed", "jump", "mounting"], "histogram": ["ok", "suspect"]}[name]
    assert [each for each in expected if each not in named] == []
    starts = [float(x) for path in root.iter(f"{SVG}path") for x in re.findall(r"M([-\d.]+)", path.get("d"))]
    assert starts
    assert -1 <= min(starts) <= max(starts) <= 1281


def test_nothing_of_a_files_name_is_in_a_chart():
    rows = [row("]]><script>alert(1)</script>.png", 1.0), row("b.png", None, message="<img onerror=1>")]
    for chart in charts(rows).values():
        text = svg_file(lay_out(chart, 1280, 560)).decode()
        assert "alert" not in text
        assert "onerror" not in text
        assert {each.tag for each in ET.fromstring(text).iter()} <= {
            f"{SVG}{tag}" for tag in ("svg", "title", "rect", "path", "text")
        }


def test_no_line_is_drawn_across_suspect_frames():
    rows = [row(f"{i}.png", 1.0, None) for i in range(30)]
    rows[10:20] = [row(f"{i}.png", 3.0, None, "suspect") for i in range(10, 20)]
    shown = decoded(png_file(lay_out(all_charts(rows)["roll"], 1280, 560, 18.0)))
    columns = np.flatnonzero(of_colour(shown, "c1")[100:].any(axis=0))
    (gap,) = np.diff(columns)[np.diff(columns) > 60]  # dots of one frame each have no gap
    assert gap == pytest.approx(11 / 30 * 1280 * 1.5, rel=0.1)


def test_a_thinned_line_reaches_as_far_up_and_down_in_each_column():
    rng = np.random.default_rng(6)
    values = rng.normal(0, 1, 20_000)
    laid = lay_out(
        all_charts([row(f"{i}.png", float(v), None) for i, v in enumerate(values)])["roll"], 1000, 368
    )
    (line,) = [item for item in laid.inside if isinstance(item, Line) and item.colour == "c1"]
    assert len(line.points) <= 4 * 1000
    _, _, width, height = laid.frame
    low, high = 1 - 200, 20_000 + 200
    columns = np.floor((np.arange(1, 20_001) - low) / (high - low) * width)
    kept = np.floor(line.points[:, 0])
    for column in (100, 400, 700):
        given, drawn = values[columns == column], line.points[kept == column, 1]
        assert len(given) > len(drawn) > 1
        ends = [given.max(), given.min()]
        place = np.interp([drawn.min(), drawn.max()], [0, height], sorted(axis_ends(laid), reverse=True))
        assert place == pytest.approx(ends, abs=1e-6)


def axis_ends(laid):
    """The values at the upper and lower edge, from two labels of the axis."""
    _, top, _, height = laid.frame
    labels = [item for item in laid.around if isinstance(item, Words) and item.anchor == "end"]
    values = [float(each.text.replace("−", "-")) for each in labels]
    heights = [each.y - 0.35 * laid.font - top for each in labels]
    per_pixel = (values[-1] - values[0]) / (heights[-1] - heights[0])
    return [values[0] + (edge - heights[0]) * per_pixel for edge in (0, height)]


def blurred(mask):
    return cv2.blur(mask.astype(np.float32), (15, 15))


@pytest.mark.parametrize("name", ["roll", "histogram"])
def test_a_browser_shows_the_svg_as_the_png_is(browser, tmp_path, sketches, name):
    (tmp_path / "chart.svg").write_bytes(svg_file(sketches[name]))
    page = browser.new_page(viewport={"width": 1280, "height": 560}, device_scale_factor=1.5)
    page.goto((tmp_path / "chart.svg").as_uri())
    data = page.screenshot()
    page.close()
    seen, made = decoded(data), decoded(png_file(sketches[name]))
    assert seen.shape == made.shape == (840, 1920, 3)
    inner = np.s_[100:720, 120:1880]  # letters differ
    for colour in ("c1", "suspect"):
        one, other = (blurred(of_colour(each, colour)[inner]) for each in (seen, made))
        assert one.sum() > 0
        assert np.abs(one - other).sum() < 0.3 * one.sum(), colour


def test_pictures_are_the_same_each_time(sketches):
    anew = sketch(drive())
    assert png_file(anew) == png_file(sketches["roll"])
    assert svg_file(anew) == svg_file(sketches["roll"])


@pytest.mark.parametrize(
    "rows",
    [
        [row("a.png", 1.0, 0.1)],
        [row("a.png", 0.0, 0.0)] * 500,
        [row("a.png", None)] * 3,
        [row("a.png", 3.0, None, "suspect")],
        [row("a.png", 1.0, 0.1), row("b.png", -80.0, 20.0, "suspect"), row("c.png", 1.1, 0.1)],
    ],
)
def test_every_kind_of_result_has_charts(rows):
    for chart in charts(rows).values():
        laid = lay_out(chart, 350, 304, 11.0)
        assert ET.fromstring(svg_file(laid)) is not None
        assert len(png_file(laid)) > 1000


def test_light_and_dark_have_the_same_colours():
    assert LIGHT.keys() == DARK.keys()
