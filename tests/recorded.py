"""What this version finds on fixed inputs, kept beside the tests of each package as ``recorded.json``.

    python -m tests.recorded [PACKAGE ...]

writes the records anew. A change of the program that moves them says why.
"""

import importlib
import json
import math
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parent


def written(value):
    """The value as JSON has it: arrays as lists, floats with the digits that count, no infinities."""
    if isinstance(value, dict):
        return {str(key): written(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        return written(value.tolist())
    if isinstance(value, list | tuple):
        return [written(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else str(value)
    return value


def differences(found, recorded, tolerance, place=""):
    """Where two values differ by more than the tolerance, relative to 1 or to what was recorded."""
    if isinstance(found, dict) and isinstance(recorded, dict) and found.keys() == recorded.keys():
        pairs = [(f"{place}/{key}", found[key], recorded[key]) for key in found]
    elif isinstance(found, list) and isinstance(recorded, list) and len(found) == len(recorded):
        pairs = [
            (f"{place}/{number}", *pair) for number, pair in enumerate(zip(found, recorded, strict=True))
        ]
    else:
        numbers = all(isinstance(each, float) for each in (found, recorded))
        if found == recorded or (numbers and abs(found - recorded) <= tolerance * max(1, abs(recorded))):
            return []
        return [f"{place}: {found} and not {recorded}"]
    return [each for at, one, other in pairs for each in differences(one, other, tolerance, at)]


def unlike_record(package, found, tolerance):
    """Where the results of a package differ from its record."""
    recorded = json.loads((TESTS / package / "recorded.json").read_text("utf-8"))
    return differences(written(found), recorded, tolerance)


def main(packages):
    """Write the records of the packages."""
    for package in packages or sorted(path.parent.name for path in TESTS.glob("*/test_recorded.py")):
        found = importlib.import_module(f"tests.{package}.test_recorded").results()
        lines = [f"{json.dumps(name)}: {json.dumps(written(value))}" for name, value in found.items()]
        text = "{\n" + ",\n".join(lines) + "\n}\n"
        (TESTS / package / "recorded.json").write_text(text, "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
