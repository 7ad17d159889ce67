"""What `rollcli --versions` says; kept apart, since nothing else needs these modules at each start."""

import platform
import re
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, requires, version

from rollcli import __version__

_OPENCV = tuple(f"opencv-{name}python{kind}" for name in ("", "contrib-") for kind in ("-headless", ""))


def versions() -> Iterator[tuple[str, str]]:
    """Yield (name, version) of rollcli, Python and each package it uses; of extras, those installed."""
    yield "rollcli", __version__
    yield "Python", f"{platform.python_version()} ({platform.python_implementation()}, {platform.platform()})"
    seen = set()
    for requirement in _requirements():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        found = _installed(_OPENCV if name in _OPENCV else (name,))
        if name not in seen and (found or ";" not in requirement):
            yield found or (name, "not installed")
        seen.add(name)


def _requirements() -> list[str]:
    try:
        return requires("rollcli") or []
    except PackageNotFoundError:  # it runs from its folder, and was not installed
        return []


def _installed(names: Sequence[str]) -> tuple[str, str] | None:
    """Find the first installed one of several packages that contain the same module."""
    for name in names:
        try:
            return name, version(name)
        except PackageNotFoundError:
            continue
    return None
