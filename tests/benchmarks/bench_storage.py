"""Maps from a bucket to a bucket, with 50 ms added to every request, against the same maps on disk.

python tests/benchmarks/bench_storage.py [frames] [rounds] [jobs]
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from timed import timed

from tests.object_store import object_store
from tests.run_cli import command, contents, environment, road_map, write_kitti
from tests.store_proxy import proxied

DELAY_S = 0.05


def run(place: str, folder: Path, jobs: int, **variables: str) -> tuple[float, float]:
    """Wall and CPU seconds of a run over the maps of a place, with de-rotated images."""
    line = command("estimate", f"{place}/maps", "-q", "-j", str(jobs), "-o", f"{place}/rolls.csv")
    line += ["--derotated", f"{place}/level", "--overwrite"]
    return timed(line, environment(**variables), cwd=folder)


def upload(folder: Path, bucket: str) -> None:
    """Put the maps into the bucket, and leave their store open in no process that benchmarks."""
    code = (
        "import sys; from pathlib import Path; from rollcli.files.storage import write_bytes\n"
        "for path in Path(sys.argv[1]).iterdir():\n"
        "    write_bytes(f'{sys.argv[2]}/maps/{path.name}', path.read_bytes())"
    )
    subprocess.run([sys.executable, "-c", code, folder, bucket], check=True, env=environment(**os.environ))


def main() -> None:
    """Print one table."""
    frames, rounds, jobs = [int(text) for text in sys.argv[1:4]] + [500, 3, 1][len(sys.argv) - 1 :]
    found: list[dict[str, tuple[float, float]]] = []
    with tempfile.TemporaryDirectory() as name, object_store() as store:
        folder = Path(name)
        for i in range(frames):
            write_kitti(
                folder / "maps" / f"{i:04}.png", road_map(0.002 * (i % 50), width=1242, height=375, seed=i)
            )
        os.environ.update(store)
        upload(folder / "maps", "s3://maps/bench")
        with proxied(store["AWS_ENDPOINT_URL"], delay_s=DELAY_S) as address:
            far = {**store, "AWS_ENDPOINT_URL": address, "ROLLCLI_STORE_TIMEOUT": "60"}
            for _ in range(rounds):
                here, there = run(".", folder, jobs), run("s3://maps/bench", folder, jobs, **far)
                found.append({"here": here, "there": there})
        images = len(contents(folder / "level"))
    print(f"{frames} 16-bit PNGs of 1242x375, {images} de-rotated, -j{jobs}, median of {rounds} rounds")
    for place, words in (("here", "on disk"), ("there", f"in a bucket, {1000 * DELAY_S:.0f} ms a request")):
        wall, cpu = (statistics.median(each[place][i] for each in found) for i in (0, 1))
        rate = f"{frames / wall:6.1f} frames/s, {1000 * cpu / frames:5.1f} ms CPU a frame"
        print(f"{words:30} {rate}; it computes {cpu / wall:.0%} of the time")
    ratio = statistics.median(each["here"][0] / each["there"][0] for each in found)
    print(f"{ratio:.2f} of the local rate (at least 0.8)")


if __name__ == "__main__":
    main()
