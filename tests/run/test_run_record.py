"""FILE.run.json: what it holds and what is read back; the roll of the rig that ends a run."""

import pytest

from rollcli.files.results import Row
from rollcli.run import summary
from rollcli.run.options import (
    EncodingOptions,
    ImageOptions,
    InputOptions,
    MethodOptions,
    RegionOptions,
    ResultOptions,
)
from rollcli.run.summary import Figures, RunSummary
from tests.run.estimate_options import estimate_options
from tests.run_cli import write_maps


@pytest.fixture
def options(tmp_path):
    write_maps(tmp_path / "maps", 3)
    return estimate_options(
        inputs=InputOptions((str(tmp_path / "maps"),)),
        encoding=EncodingOptions(scale=0.5, invalid=(1.0, 2.0)),
        region=RegionOptions(roi=(0, 0, 9, 9)),
        method=MethodOptions(method="gss"),
        images=ImageOptions(derotated=str(tmp_path / "up")),
        result=ResultOptions(output=str(tmp_path / "rolls.csv")),
    )


def test_of_more_frames_than_memory_is_meant_for_the_answer_names_who_has_it(monkeypatch):
    monkeypatch.setattr(summary, "_MOST_FRAMES", 3)
    found = RunSummary()
    for number in range(5):
        found.add_row(Row(f"{number}.png", status="ok", roll_deg=1.0, roll_ci95_deg=0.1))
        found.replace([number], Figures.of([Row(f"{number}.png")]))
    assert found.rig_roll() == "more than 3 frames: rollcli rig RESULT says what they say of the rig"
