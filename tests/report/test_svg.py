"""What a sketch is as SVG."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from rollcli.report.chart import Chart
from rollcli.report.colours import DARK, LIGHT, rgb, style_sheet
from rollcli.report.figures import Area, Line, Marks, Sketch, Words, svg_file, svg_for_page, with_still

SVG = "{http://www.w3.org/2000/svg}"
POINTS = np.array([(10.04, 20.0), (13.0, 18.26), (-4.5, 1e4)])


def elements(inside=(), around=()):
    """The elements in the frame, and those around it."""
    root = ET.fromstring(
        svg_file(Sketch("a < b", 400, 300, 13.5, (30, 20, 350, 250), tuple(inside), tuple(around)))
    )
    frame = root.find(f"{SVG}svg")
    assert [frame.get(name) for name in ("x", "y", "width", "height", "overflow")] == [
        "30",
        "20",
        "350",
        "250",
        "hidden",
    ]
    return list(frame), [each for each in root if each.tag in (f"{SVG}path", f"{SVG}text")]


def places(path):
    """The corners of a path of one M and some l."""
    steps = [tuple(map(float, each.split())) for each in re.split("[Ml]", path.removesuffix("Z"))[1:]]
    return np.cumsum(steps, axis=0)


def test_a_path_leads_through_its_points_to_a_tenth_of_a_pixel():
    (line, dashed, area), _ = elements(
        [Line(POINTS, "c1", 1.2345678), Line(POINTS[:1], "c1", 2, 6.5), Area(POINTS, "band")]
    )
    for each in (line, area):
        np.testing.assert_allclose(places(each.get("d")), POINTS, atol=0.0501)
    assert (line.get("stroke-width"), line.get("fill"), line.get("stroke-dasharray")) == (
        "1.235",
        "none",
        None,
    )
    assert line.get("stroke") == f"#{LIGHT['c1'][0]}"
    assert (dashed.get("stroke-dasharray"), dashed.get("stroke-width")) == ("6.5", "2")
    assert area.get("d").endswith("Z")
    assert (area.get("fill"), area.get("fill-opacity")) == (f"#{LIGHT['band'][0]}", "0.16")


@pytest.mark.parametrize(
    ("symbol", "shape"),
    [
        ("circle", "m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0"),
        ("diamond", "m0 -4l4 4l-4 4l-4 -4Z"),
        ("cross", "m-4 -4l8 8m0 -8l-8 8"),
    ],
)
def test_a_mark_is_drawn_at_each_of_its_points(symbol, shape):
    ((marks,), _) = elements([Marks(np.array([(10.0, 20.0), (5.55, 7.0)]), "error", symbol, 8.0)])
    first, second = re.split("(?<!^)M", marks.get("d"))
    assert (first, second) == (f"M10.0 20.0{shape}", f"5.5 7.0{shape}")
    drawn = (marks.get("fill"), marks.get("stroke"), marks.get("stroke-width"))
    colour = f"#{LIGHT['error'][0]}"
    assert drawn == (("none", colour, "2") if symbol == "cross" else (colour, None, None))


def test_words_stand_at_their_places_and_turn_about_them():
    _, (lying, upright) = elements(
        around=[Words(10.5, 20, "a & b", "text", "end"), Words(7, 150, "up", "text", "middle", upright=True)]
    )
    assert (lying.text, lying.get("x"), lying.get("y"), lying.get("text-anchor")) == (
        "a & b",
        "10.5",
        "20",
        "end",
    )
    assert (lying.get("transform"), upright.get("transform")) == (None, "rotate(-90 7 150)")


def test_on_a_page_it_has_the_pages_colours():
    sketch = Sketch(
        "", 400, 300, 11.0, (30, 20, 350, 250), (Line(POINTS, "c1", 1),), (Words(1, 2, "a", "text"),)
    )
    root = ET.fromstring(svg_for_page(sketch, "still"))
    assert (root.get("class"), root.get("viewBox"), root.get("font-size")) == ("still", "0 0 400 300", "11")
    assert (root.find("svg/path").get("stroke"), root.find("text").get("fill")) == (
        "var(--c1)",
        "var(--text)",
    )


def test_a_chart_has_a_picture_for_wide_and_one_for_narrow_screens():
    title = {"title": {"text": "x"}, "range": [0, 1]}
    line = {
        "type": "scatter",
        "mode": "lines",
        "name": "a",
        "x": [0, 1],
        "y": [0, 1],
        "line": {"color": "@c1", "width": 1},
    }
    chart = with_still(Chart("roll", "what", [line], {"xaxis": title, "yaxis": title}))
    found = re.findall(r'<svg class="still (\S+)" viewBox="0 0 (\d+) (\d+)" font-size="(\d+)"', chart.still)
    assert found == [("wide-screen", "1000", "368", "13"), ("narrow-screen", "350", "352", "11")]
    assert (chart.name, chart.label) == ("roll", "what")


def test_the_style_sheet_holds_every_colour_of_both_modes():
    light, dark = style_sheet().split("@media (prefers-color-scheme: dark)")
    for sheet, colours in ((light, LIGHT), (dark, DARK)):
        found = dict(re.findall(r"--([\w-]+): rgba(\([^)]+\));", sheet))
        assert found == {name: str((*rgb(name, colours), colours[name][1])) for name in colours}
    assert rgb("c1") == (0x25, 0x63, 0xC9)
