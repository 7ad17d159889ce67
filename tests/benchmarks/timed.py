"""How long a program takes, and how long it computes."""

import resource
import subprocess
import time
from collections.abc import Mapping
from typing import Any


def timed(line: list[str], environment: Mapping[str, str], **how: Any) -> tuple[float, float]:
    """Run a program that must end well; its wall and CPU seconds, those of its own children included."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(line, env=environment, check=True, **how)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
