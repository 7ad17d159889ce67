"""A client that uses every public name of rollcli: it must pass mypy --strict (tests/test_python.py)."""

import json
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import rollcli
from rollcli import Calibration, RigAssessment, RollEstimate, StereoOptions, Tangent, VDisparity

Floats = NDArray[np.float32]


def road(roll: float, seed: int = 0) -> Floats:
    v, u = np.mgrid[:120, :160]
    noise = np.random.default_rng(seed).normal(0, 0.05, v.shape)
    return np.asarray(20 + 0.3 * (v * math.cos(roll) - u * math.sin(roll)) + noise, np.float32)


def views(width: int = 320) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    right = np.random.default_rng(0).integers(0, 256, (120, width), dtype=np.uint8)
    return np.stack([np.roll(row, 10 + v // 8) for v, row in enumerate(right)]), right


def pose(disparity: Floats, calibration: Path) -> str:
    rig: Calibration = rollcli.read_calibration(calibration)
    try:
        estimate: RollEstimate = rollcli.estimate_roll(disparity, calibration=rig, road_mask=True)
    except (rollcli.EstimationError, rollcli.InputError, rollcli.UsageError) as error:
        return str(error)
    tangent: Tangent = estimate.tangent
    heights: Floats = rollcli.height_map(disparity, estimate, rig)
    assert heights.shape == (estimate.height, estimate.width)
    assert tangent.slope > 0
    level = rollcli.derotate(disparity, estimate.theta)
    same = rollcli.derotate(disparity, roll_deg=estimate.roll_deg, expand=False)
    assert np.allclose(level, same)
    histogram: VDisparity = rollcli.v_disparity(level, bins=64)
    assert histogram.counts.sum() == np.count_nonzero(level)
    return json.dumps(estimate.to_dict())


def matched() -> float:
    left, right = views()
    options = StereoOptions(num_disparities=32, align="off")
    disparity: Floats = rollcli.compute_disparity(left, right, num_disparities=32, align="off")
    found = rollcli.estimate_pair(left, right, stereo=options, road="all")
    alone = rollcli.estimate_roll(disparity, road="all", method="exact")
    return max(abs(found.roll_deg), abs(alone.roll_deg))


def main(folder: Path) -> RigAssessment:
    np.save(folder / "map.npy", road(0.1))
    (folder / "calib.txt").write_text(
        "P0: 700 0 79 0 0 700 59 0 0 0 1 0\nP1: 700 0 79 -350 0 700 59 0 0 0 1 0\n"
    )
    said = json.loads(pose(rollcli.read_disparity(folder / "map.npy"), folder / "calib.txt"))
    assert rollcli.__version__
    assert abs(said["roll_deg"] - math.degrees(0.1)) < 0.1, said
    assert matched() < 1
    try:
        stamps: list[int] = [frame.stamp for frame in rollcli.open_recording(folder / "map.npy")]
        raise SystemExit(f"a map is no bag: {stamps}")
    except rollcli.UsageError:
        pass
    try:
        return rollcli.assess_rig([rollcli.estimate_roll(road(0.1, seed)) for seed in range(12)])
    except rollcli.RollcliError as error:
        raise SystemExit(str(error)) from error
