"""sample_data is what its script makes, and its truth is true."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from rollcli.files.encodings import read_disparity
from rollcli.files.formats import read_image
from rollcli.simulate.build import true_disparity
from tests.make_sample_data import EXACT, SAMPLES, SPECS, make

STEMS = [f"frame_{number:04d}" for number in range(1, len(SPECS) + 1)]


def files(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    make(folder)
    return folder


def test_the_script_makes_the_same_files_and_the_same_truth(made):
    assert files(SAMPLES) == files(made)
    assert (SAMPLES / "truth.csv").read_text() == (made / "truth.csv").read_text()


def test_the_script_makes_the_same_pictures(made):
    # other versions compress in other ways, and other processors may round a grey level to its neighbour
    for name in (f"{side}/{stem}.png" for side in ("left", "right") for stem in STEMS):
        difference = np.abs(read_image(SAMPLES / name).astype(float) - read_image(made / name))
        assert np.mean(difference > 1) < 1e-4


@pytest.mark.parametrize(("stem", "spec"), list(zip(STEMS, SPECS, strict=True)))
def test_each_map_shows_its_scene_with_the_roll_that_truth_says(stem, spec):
    rows = {row["file"]: row for row in csv.DictReader((SAMPLES / "truth.csv").read_text().splitlines())}
    assert float(rows[stem]["roll_deg"]) == pytest.approx(math.degrees(spec.roll))
    (path,) = (SAMPLES / "maps").glob(f"{stem}.*")
    found, (disparity, road) = read_disparity(path), true_disparity(spec)
    both = road & (found > 0)
    assert both.sum() > 0.6 * road.sum()
    error = np.abs(found - disparity)[both]
    assert error.max() <= 1 / 256 if stem == EXACT else np.median(error) < 0.3


def test_the_samples_are_small():
    assert sum(path.stat().st_size for path in SAMPLES.rglob("*")) < 3e6
