"""Files that the readers once stumbled over, or printed about; each is refused now."""

import struct

import numpy as np

from tests.binary_files import make_tiff, npy_header, with_fields


def _one_bit_tiff() -> bytes:
    """Pixels of one bit, which tifffile decodes, in Deflate data that are wrong."""
    file = make_tiff(np.zeros((11, 17), np.uint8), "deflate")
    return with_fields(file[:8] + bytes(4) + file[12:], {258: (8, 1)})


def _many_strips() -> bytes:
    """Millions of strips, by an unknown compression, of which three are there."""
    file = make_tiff(np.zeros((12, 17), np.uint16), "deflate", rows_per_strip=4)
    return with_fields(file, {257: (12, 7_233_902), 259: (8, 65285)})


def _npy(descr: str) -> bytes:
    return npy_header(f"{{'descr': {descr}, 'fortran_order': False, 'shape': (1, 1), }}\n") + bytes(8)


CASES = {
    "a BMP whose header has 2^31 bytes": struct.pack(
        "<2sIHHIIiiHHIIiiII", b"BM", 78, 0, 0, 54, 2**31, 2, 2, 1, 24, 0, 24, 0, 0, 0, 0
    )
    + bytes(24),
    "Deflate data that tifffile inflates": _one_bit_tiff(),
    "strips that are not there": _many_strips(),
    "a line break in an NPY type": _npy("'<f\n4'"),
    "an escape in an NPY type": _npy(r"'<f\s4'"),
}
