"""Every chart of a result: what its page shows, and what is written for slides."""

from collections.abc import Sequence

from rollcli.files.results import Row
from rollcli.report.charts.chart import Chart
from rollcli.report.charts.histogram import histogram
from rollcli.report.charts.names import HISTOGRAM, chart_names
from rollcli.report.charts.over_frames import chart_over_frames
from rollcli.rig.assess import RigAssessment
from rollcli.rig.quantities import QUANTITIES


def all_charts(rows: Sequence[Row], rig: RigAssessment | None = None) -> dict[str, Chart]:
    """Return the charts of `chart_names` by their names."""
    quantities = {each.name: each for each in QUANTITIES}
    return {
        name: histogram(rows) if name == HISTOGRAM else chart_over_frames(rows, quantities[name], rig)
        for name in chart_names(rows)
    }
