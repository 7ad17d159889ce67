"""Whole files of each readable format and kind, small enough to reach every byte of them."""

import zlib
from collections.abc import Iterable

import cv2
import numpy as np

from tests.binary_files import disparity_map, make_npy, make_npz, make_pfm, make_png, make_tiff

MAP = disparity_map(11, 17)
READERS = {
    "png": (".png",),
    "tiff": (".tif",),
    "npy": (".npy",),
    "npz": (".npz",),
    "pfm": (".pfm",),
    "pictures": (".jpg", ".bmp", ".ppm", ".pgm"),
}
GREYS = bytes(np.repeat(np.arange(256, dtype=np.uint8), 3))


def corpus(readers: Iterable[str] = READERS) -> dict[str, bytes]:
    """Name and bytes of each file that the readers of pictures among these read."""
    grey, deep, real = MAP.astype(np.uint8), (MAP * 256).astype(np.uint16), MAP.astype(np.float32)
    colour = np.dstack([grey, grey // 2, grey])
    text = (b"tEXt", b"Comment\0made by hand")
    files = {
        "8.png": make_png(grey, 8),
        "16.png": make_png(deep, extra=[text, (b"gAMA", bytes([0, 0, 177, 143]))]),
        "1.png": make_png(grey % 2, 1),
        "interlaced.png": make_png(deep, interlace=True),
        "palette.png": make_png(grey % 4, 2, colour=3, palette=GREYS[:12]),
        "alpha.png": make_png(np.dstack([grey, grey]), 8, colour=4),
        "colour.png": make_png(colour, 8, colour=2),
        "large.png": make_png(np.tile(deep, (20, 20))),
        "f4.npy": make_npy(real),
        "u2.npy": make_npy(np.asfortranarray(deep.astype(">u2"))),
        "version2.npy": make_npy(MAP, version=(2, 0)),
        "archive.npz": make_npz(np.savez, disparity=real),
        "little.pfm": make_pfm(real),
        "big.pfm": make_pfm(real, "Pf\n# made by hand\n{width} {height}\n{scale}\n", scale="1.0"),
        "picture.jpg": cv2.imencode(".jpg", colour)[1].tobytes(),
        "picture.bmp": cv2.imencode(".bmp", colour)[1].tobytes(),
        "picture.ppm": cv2.imencode(".ppm", colour)[1].tobytes(),
        "picture.pgm": cv2.imencode(".pgm", deep)[1].tobytes(),
    }
    for compression in ("none", "lzw", "deflate", "packbits"):
        files[f"{compression}.tif"] = make_tiff(deep, compression, rows_per_strip=4)
        files[f"{compression}-tiles.tif"] = make_tiff(real, compression, ">", tile=(16, 16), nodata="-1")
    files["predictor2.tif"] = make_tiff(deep, "lzw", predictor=2)
    files["predictor3.tif"] = make_tiff(real, "deflate", predictor=3)
    files["big.tif"] = make_tiff(real, "deflate", big=True)
    files["pages.tif"] = make_tiff(grey, pages=3)
    files["colour.tif"] = make_tiff(colour, "lzw", photometric=2)
    endings = tuple(ending for reader in readers for ending in READERS.get(reader, ()))
    return {name: whole for name, whole in files.items() if name.endswith(endings)}


def repaired_png(data: bytes) -> bytes:
    """A PNG file with the right checksum after each chunk: what is wrong lies deeper then."""
    parts, position = [data[:8]], 8
    while position + 12 <= len(data):
        end = min(position + 12 + int.from_bytes(data[position : position + 4], "big"), len(data))
        body = data[position + 4 : end - 4]
        parts += [data[position : position + 4], body, zlib.crc32(body).to_bytes(4, "big")]
        position = end
    return b"".join(parts)
