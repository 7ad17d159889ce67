"""Pictures that stand where a page's charts will be, so that a page is whole before any script has run."""

from dataclasses import replace

from rollcli.report.charts.chart import Chart
from rollcli.report.drawing.lay_out import lay_out
from rollcli.report.drawing.svg import svg_for_page

# width, height and font of the chart's place on the page, pixels; the page's styles show one of them
_WIDE, _NARROW = (1000, 368, 13.0), (350, 352, 11.0)


def with_still(chart: Chart) -> Chart:
    """Return the chart with its pictures for wide and for narrow screens."""
    wide = svg_for_page(lay_out(chart, *_WIDE), "still wide-screen")
    narrow = svg_for_page(lay_out(chart, *_NARROW), "still narrow-screen")
    return replace(chart, still=wide + narrow)
