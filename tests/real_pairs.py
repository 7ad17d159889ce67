"""Real maps, pairs and bags beside the project, of which they are no part, and pairs of a lidar's streets."""

from pathlib import Path

import pytest

from rollcli.files.formats import read_image

SHARED = Path(__file__).parents[1].parent / "shared"
LIDAR, REALMAPS, ROADS, STREETS = (SHARED / name for name in ("lidar", "realmaps", "roads", "streets"))
# of the pairs of ROADS, as their README has them
ROLL_DEG = {"m1_L1": -3.47, "m1_L5": -1.62, "m2_L9": -2.54, "m2_L18": -4.30, "m3_L3": 2.36}


def _needs(folder):
    return pytest.mark.skipif(not folder.is_dir(), reason=f"what is real is not here: {folder}")


needs_lidar, needs_maps, needs_roads, needs_streets = map(_needs, (LIDAR, REALMAPS, ROADS, STREETS))


def real_pairs(which, folder=LIDAR):
    """The left and the right views of a slice of the pairs, in the order of their names."""
    named = sorted((folder / "left").iterdir())[which]
    return [tuple(read_image(str(folder / side / left.name)) for side in ("left", "right")) for left in named]
