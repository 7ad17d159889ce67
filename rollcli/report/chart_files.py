"""The charts of a result as files for slides."""

from collections.abc import Mapping

from rollcli.report.charts.chart import Chart
from rollcli.report.drawing.lay_out import lay_out
from rollcli.report.drawing.png import png_file
from rollcli.report.drawing.svg import svg_file
from rollcli.report.options import ReportOptions

_WIDTH, _HEIGHT, _FONT = 1280, 560, 18.0  # pixels: a slide leaves so much below its title
_WRITERS = {"svg": svg_file, "png": png_file}


def chart_files(charts: Mapping[str, Chart], options: ReportOptions) -> dict[str, bytes]:
    """Return the content of each file that is asked for."""
    files: dict[str, bytes] = {}
    for name, chart in charts.items():
        for kind, path in options.chart_paths(name).items():
            files[path] = _WRITERS[kind](lay_out(chart, _WIDTH, _HEIGHT, _FONT))
    return files
