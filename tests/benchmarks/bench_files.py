"""What reading costs beside bare decoding; de-rotation, v-disparity and matching: maps of 1242 x 375 pixels.

python tests/benchmarks/bench_files.py [rounds]
"""

import math
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import cv2
import numpy as np

from rollcli.files.codecs import png
from rollcli.files.encodings import to_disparity
from rollcli.files.formats import decode_stored, encode_stored
from rollcli.pictures.derotate import derotate
from rollcli.pictures.overlay import draw_road
from rollcli.pictures.vdisparity import draw_v_disparity, v_disparity
from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from rollcli.stereo.match import StereoOptions, match_pair
from tests.binary_files import disparity_map, make_tiff

SIZE = (1242, 375)


def best(jobs: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Milliseconds of the fastest run of each job; the jobs take turns, so that a slow moment hits all."""
    times = dict.fromkeys(jobs, math.inf)
    for _ in range(rounds):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            times[name] = min(times[name], 1e3 * (time.perf_counter() - start))
    return times


def show(title: str, times: Mapping[str, float], beside: str) -> None:
    """One table; the last column compares with the line `beside`."""
    print(f"\n{title:44}      ms   beside {beside}")
    for name, value in times.items():
        print(f"  {name:42} {value:7.2f}   {value / times[beside]:5.2f}")


def without_extras(file: bytes) -> object:
    """Read a file as where `fast` is not installed."""
    with patch.object(png, "imagecodecs", lambda: None):
        return decode_stored(file, "map")


def main() -> None:
    """Print the tables."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    cv2.setNumThreads(1)
    pixels = disparity_map(SIZE[1], SIZE[0])
    kitti, real = (pixels * 256).clip(0).astype(np.uint16), pixels.astype(np.float32)
    noisy = encode_stored(kitti, "png")
    plane = encode_stored(np.repeat(np.arange(375, dtype=np.uint16)[:, None] * 64, 1242, axis=1), "png")
    for title, file in (("16-bit PNG, noisy", noisy), ("16-bit PNG, a bare plane", plane)):
        data = np.frombuffer(file, np.uint8)
        stored = decode_stored(file, title)
        jobs = {
            "cv2.imdecode": lambda data=data: cv2.imdecode(data, cv2.IMREAD_UNCHANGED),
            "decode_stored": lambda file=file: decode_stored(file, "map.png"),
            "decode_stored, without extras": lambda file=file: without_extras(file),
            "to_disparity": lambda stored=stored: to_disparity(stored),
        }
        show(f"{title} ({len(file) // 1024} KiB)", best(jobs, rounds), "cv2.imdecode")

    for title, kind, compression, predictor in (
        ("TIFF, uint16, Deflate", kitti, "deflate", 1),
        ("TIFF, uint16, Deflate, predictor 2", kitti, "deflate", 2),
        ("TIFF, float32, Deflate", real, "deflate", 1),
        ("TIFF, float32, Deflate, predictor 3", real, "deflate", 3),
        ("TIFF, uint16, LZW", kitti, "lzw", 1),
        ("TIFF, float32, PackBits", real, "packbits", 1),
    ):
        file = make_tiff(kind, compression, predictor=predictor, rows_per_strip=8)
        jobs = {
            "cv2.imdecode": lambda file=file: cv2.imdecode(
                np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED
            ),
            "decode_stored": lambda file=file: decode_stored(file, "map.tif"),
        }
        show(title, best(jobs, rounds // 4 + 1), "cv2.imdecode")

    files = {
        "PNG, uint16": noisy,
        "NPY, float32": encode_stored(real, "npy"),
        "PFM": encode_stored(real, "pfm"),
        "TIFF, float32": make_tiff(real, rows_per_strip=8),
        "TIFF, float32, Deflate, predictor 3": make_tiff(real, "deflate", predictor=3, rows_per_strip=8),
        "TIFF, uint16, LZW, predictor 2": make_tiff(kitti, "lzw", predictor=2, rows_per_strip=8),
        "TIFF, uint16, PackBits": make_tiff(kitti, "packbits", rows_per_strip=8),
    }
    jobs = {name: lambda file=file: decode_stored(file, "map") for name, file in files.items()}
    show("reading", best(jobs, rounds // 3 + 1), "PNG, uint16")

    frame = render_frame(FrameSpec(scene="street", roll=math.radians(3), size=SIZE, focal=721.0))
    views = frame.left, frame.right
    level = v_disparity(derotate(real, 0.05))
    jobs = {
        "derotate, float32": lambda: derotate(real, 0.05),
        "derotate, uint16": lambda: derotate(kitti, 0.05),
        "v_disparity": lambda: v_disparity(real),
        "draw_v_disparity": lambda: draw_v_disparity(level, (-1.0, 0.2, 0.0)),
        "draw_road": lambda: draw_road(frame.disparity, frame.road),
        "match_pair, range given": lambda: match_pair(*views, StereoOptions(num_disparities=128)),
        "match_pair, range found": lambda: match_pair(*views, StereoOptions()),
    }
    show("imaging", best(jobs, 5), "match_pair, range given")


if __name__ == "__main__":
    main()
