"""Drives of whose frames hardly any counts, or all that do lie close together."""

import numpy as np
import pytest

from rollcli.rig.drive.quantity import assess_sequence


@pytest.mark.parametrize("frames", [1, 2, 9, 200, 2000, 20_000])
@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 16, 17, 40])
@pytest.mark.parametrize("where", ["first", "middle", "last", "spread"])
def test_whatever_counts_gives_a_mean_among_its_frames(frames, count, where):
    count = min(count, frames)
    start = {"first": 0, "middle": (frames - count) // 2, "last": frames - count, "spread": 0}[where]
    places = np.linspace(0, frames - 1, count).astype(int) if where == "spread" else start + np.arange(count)
    values = np.full(frames, np.nan)
    values[places] = np.random.default_rng(count).normal(1.0, 0.1, count)

    found = assess_sequence(values, np.full(frames, 0.05))

    assert found.used == count
    mean = found.segments[-1].mean.value
    assert np.nanmin(values) - 1e-9 <= mean <= np.nanmax(values) + 1e-9
    assert (found.now.ci95 is None) == (count < 8)
    assert (found.drift.value is None) or count >= 8
