"""Ask what a path is. Nothing is raised: a path that the system refuses to look at is not there."""

import os
from pathlib import Path


def is_folder(path: str | Path) -> bool:
    """Tell whether this is a folder, or a link to one."""
    return os.path.isdir(path)  # noqa: PTH112 (Path.is_dir raises for long names and without permission)


def is_file(path: str | Path) -> bool:
    """Tell whether this is a regular file, or a link to one."""
    return os.path.isfile(path)  # noqa: PTH113


def is_there(path: str | Path) -> bool:
    """Tell whether this is anything at all; a link to nothing is not."""
    return os.path.exists(path)  # noqa: PTH110
