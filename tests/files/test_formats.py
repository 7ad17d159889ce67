"""Map files are read as they are stored, whatever their format."""

import numpy as np
import pytest

from rollcli.files.formats import decode_stored, encode_stored

WRITTEN = [
    *[("png", kind) for kind in ("u1", "u2")],
    *[("tiff", kind) for kind in ("u1", "u2", "i2", "i4", "f2", "f4", "f8")],
    *[("npy", kind) for kind in ("u1", "u2", "i2", "i8", "f2", "f4", "f8")],
    ("pfm", "f4"),
]


@pytest.mark.parametrize(("form", "kind"), WRITTEN)
def test_what_is_written_is_read_back_unchanged(form, kind):
    values = np.random.default_rng(1).uniform(1, 200, (37, 53)).astype(kind)

    stored = decode_stored(encode_stored(values, form), "map")

    assert stored.format == form
    assert stored.values.dtype == values.dtype
    np.testing.assert_array_equal(stored.values, values)
