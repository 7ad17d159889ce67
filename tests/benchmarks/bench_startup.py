"""What starting the program costs, beside importing click alone.

python tests/benchmarks/bench_startup.py [rounds]
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.run_cli import command, environment

AT_MOST = 1.6
LINES = {
    'python -c "import click"': [sys.executable, "-c", "import click"],
    "rollcli --version": command("--version"),
    "rollcli --help": command("--help"),
    "rollcli estimate --help": command("estimate", "--help"),
}


def seconds(line: list[str], byte_code: str) -> float:
    """Wall time of one process, whose byte code is kept in a folder: an installed program has its own."""
    kept = {**environment(PYTHONPYCACHEPREFIX=byte_code), "PYTHONDONTWRITEBYTECODE": ""}
    start = time.perf_counter()
    subprocess.run(line, env=kept, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> None:
    """Print one table: the programs take turns, so that what else the machine does meets all of them."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    with tempfile.TemporaryDirectory() as byte_code:
        for line in LINES.values():
            seconds(line, byte_code)  # byte code is written, files are in memory
        found = [{name: seconds(line, byte_code) for name, line in LINES.items()} for _ in range(rounds)]
    bare, *_ = LINES
    print(f"{rounds} rounds; the ratio is the median of those of each round, at most {AT_MOST}")
    for name in LINES:
        ratio = statistics.median(each[name] / each[bare] for each in found)
        best = min(each[name] for each in found)
        typical = statistics.median(each[name] for each in found)
        print(f"{name:26} best {1000 * best:6.1f} ms  median {1000 * typical:6.1f} ms  ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
