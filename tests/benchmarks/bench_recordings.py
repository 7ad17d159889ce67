"""What reading recordings costs beside their libraries alone, and what a second worker gains.

python tests/benchmarks/bench_recordings.py [messages [rounds]]

Frames of 640 x 480 pixels. The library is rosbags, which opens the bag, reads and deserializes each message,
and what NumPy and OpenCV need to make an array of it; here the bag is looked through, and each frame is read
by its place, in order. The two take turns; times are CPU times, the least of some rounds.
"""

import math
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

import cv2
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from rollcli.files.formats import read_image, read_stored
from rollcli.files.naming import Input
from rollcli.files.recordings import bags, video
from rollcli.files.recordings import frames as of_bags
from rollcli.simulate.build import render_frame
from rollcli.simulate.spec import FrameSpec
from tests.files.recordings.bag_files import compressed, disparity_image, image, write_bag
from tests.run_cli import rollcli_process

SIZE, STEP, START = (640, 480), 100_000_000, 1_700_000_000_000_000_000
MAPS = {
    "mcap, DisparityImage": ("mcap", "disparity", None),
    "mcap, Image 16UC1": ("mcap", "sixteen", None),
    "mcap, CompressedImage PNG": ("mcap", "packed", None),
    "bag, DisparityImage": ("bag", "disparity", None),
    "bag of lz4 chunks, Image 16UC1": ("bag", "sixteen", "LZ4"),
    "db3, DisparityImage": ("db3", "disparity", None),
}


def write(folder: Path, name: str, kind: str, what: str, count: int, compression: str | None) -> Path:
    """Write a bag of maps that differ from frame to frame."""
    frame = render_frame(FrameSpec(scene="street", roll=math.radians(2), size=SIZE, seed=4))
    values = np.nan_to_num(frame.disparity).astype(np.float32)

    def make(store):
        for number in range(count):
            stamp = START + number * STEP
            each = np.roll(values, number, axis=1)
            whole = np.rint(256 * each).astype(np.uint16)
            if what == "disparity":
                message = disparity_image(store, each, stamp)
            elif what == "sixteen":
                message = image(store, whole, "16UC1", stamp)
            else:
                message = compressed(store, cv2.imencode(".png", whole)[1].tobytes(), "png", stamp)
            yield "/maps", stamp, message

    return write_bag(folder, name, kind, make, compression)


def by_library(path: Path) -> int:
    """Read and decode every message by rosbags."""
    total = 0
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, raw in reader.messages():
            found = reader.deserialize(raw, connection.msgtype)
            if hasattr(found, "format"):
                values = cv2.imdecode(found.data, cv2.IMREAD_UNCHANGED)
            else:
                picture = getattr(found, "image", found)
                kind = np.float32 if picture.encoding == "32FC1" else np.uint16
                values = picture.data.view(kind).reshape(picture.height, picture.width).copy()
            total += values.shape[0]
    return total


def by_rollcli(path: Path) -> int:
    """Find the frames of a bag, and read each."""
    bags._opened.cache_clear()
    found = of_bags.frames_of_bag([str(path)], str(path), "/maps", None, None, 0.0)
    return sum(read_stored(each.location, each.name).values.shape[0] for each, _ in found.frames)


def by_opencv(path: Path) -> int:
    """Decode a video, with as many threads as a worker has."""
    capture, count = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1]), 0
    while capture.read()[0]:
        count += 1
    return count


def frames_of_video(path: Path) -> int:
    """Count the frames of a video, and read each."""
    for cached in (video._look_through, video._decoder):
        cached.cache_clear()
    source = Input(str(path), path.name)
    found = video.frames_of(source, source, "left-right")
    return sum(1 for each, _ in found if read_image(each.location, each.name).size)


def cpu(job: Callable[[Path], int], path: Path) -> float:
    """Seconds of CPU time."""
    start = time.process_time()
    job(path)
    return time.process_time() - start


def compare(
    title: str, path: Path, jobs: tuple[Callable[[Path], int], Callable[[Path], int]], count: int, rounds: int
) -> None:
    """Print a line: milliseconds a frame by the library, here, and their ratio; the least of some rounds."""
    times = [[cpu(job, path) for job in jobs] for _ in range(rounds)]
    one, other = (1e3 * min(each) / count for each in zip(*times, strict=True))
    print(f"  {title:34} {one:8.2f} {other:8.2f} {other / one:6.2f}")


def workers(title: str, given: list[str], folder: Path) -> None:
    """Print a line: seconds of `estimate` with one worker and with two, and their ratio; the least of two."""
    times = {"1": math.inf, "2": math.inf}
    for _ in range(2):
        for jobs in times:
            start = time.perf_counter()
            done = rollcli_process(
                "estimate", *given, "-q", "-j", jobs, "-o", "rolls.csv", "--overwrite", cwd=folder
            )
            assert done.status == 0, done.err
            times[jobs] = min(times[jobs], time.perf_counter() - start)
    print(f"  {title:34} {times['1']:8.2f} {times['2']:8.2f} {times['1'] / times['2']:6.2f}")


def main(count: int = 300, rounds: int = 5) -> None:
    """Print the tables."""
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(
            f"{count} frames of {SIZE[0]}x{SIZE[1]}\n  {'ms of CPU time a frame':34}  library     here  ratio"
        )
        for place, (title, (kind, what, compression)) in enumerate(MAPS.items()):
            path = write(folder, f"drive{place}", kind, what, count, compression)
            compare(title, path, (by_library, by_rollcli), count, rounds)
        pair = render_frame(FrameSpec(scene="street", roll=0.03, size=SIZE, seed=4))
        both = np.hstack([pair.left, pair.right])
        for ending, codec in (("mp4", "mp4v"), ("avi", "MJPG"), ("mkv", "FFV1")):
            path = folder / f"drive.{ending}"
            writer = cv2.VideoWriter(
                str(path), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*codec), 10, (2 * SIZE[0], SIZE[1])
            )
            for number in range(max(count // 4, 1)):
                writer.write(np.roll(both, number, axis=0))
            writer.release()
            compare(f"{ending}, {codec}", path, (by_opencv, frames_of_video), max(count // 4, 1), rounds)
        print(f"\n  {'seconds of estimate':34}    -j 1     -j 2  ratio")
        workers("mcap, DisparityImage", ["drive0.mcap"], folder)
        workers("mcap, CompressedImage PNG", ["drive2.mcap", "--topic", "/maps"], folder)
        workers("mp4, mp4v", ["drive.mp4", "--side-by-side"], folder)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
