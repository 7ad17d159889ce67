"""The versions that a bug report needs, found without importing the packages."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version

from rollcli import __version__

OPENCV = (
    "opencv-python-headless",
    "opencv-python",
    "opencv-contrib-python-headless",
    "opencv-contrib-python",
)
REQUIRED = ("numpy", OPENCV, "click", "tqdm", "tifffile")
OPTIONAL = ("dask", "distributed", "imagecodecs", "jinja2", "obstore", "plotly", "pyarrow", "pywuffs")


def versions() -> Iterator[tuple[str, str]]:
    """Yield (name, version) of rollcli, Python and each package it uses; of extras, those installed."""
    yield "rollcli", __version__
    yield "Python", f"{platform.python_version()} ({platform.python_implementation()}, {platform.platform()})"
    for names in REQUIRED:
        yield _installed(names) or (names if isinstance(names, str) else names[0], "not installed")
    yield from filter(None, map(_installed, OPTIONAL))


def _installed(names: str | tuple[str, ...]) -> tuple[str, str] | None:
    """Find the first installed one of several packages that contain the same module."""
    for name in (names,) if isinstance(names, str) else names:
        try:
            return name, version(name)
        except PackageNotFoundError:
            continue
    return None
