"""Pairs of real streets of which a lidar tells the lane; they are not part of the project."""

from pathlib import Path

import pytest

from rollcli.files.formats import read_image

LIDAR = Path(__file__).parents[1].parent / "shared" / "lidar"
needs_lidar = pytest.mark.skipif(not LIDAR.is_dir(), reason="no real pairs with lidar at ../shared/lidar")


def real_pairs(which):
    """The left and the right views of a slice of the pairs, in the order of their names."""
    named = sorted((LIDAR / "left").iterdir())[which]
    return [tuple(read_image(str(LIDAR / side / left.name)) for side in ("left", "right")) for left in named]
