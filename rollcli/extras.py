"""The extras: packages that some features need, and what installs them beside the rollcli that runs."""

import logging
import shlex
import sys
from importlib import import_module
from pathlib import Path

from rollcli.errors import UsageError

# of each extra, as they are installed and imported
EXTRAS = {
    "bags": ("lz4", "rosbags", "zstandard"),
    "cluster": ("dask", "distributed"),
    "fast": ("imagecodecs",),
    "parquet": ("pyarrow",),
    "report": ("jinja2", "matplotlib", "plotly"),
    "storage": ("obstore",),
    "tiff": ("imagecodecs",),
}


def silence_matplotlib() -> None:
    """Let it not say on stderr, as soon as it is imported, that its folders cannot be written."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def require_extra(extra: str, what: str) -> None:
    """Refuse, before any work is done, what an extra that is not installed would do.

    Parameters
    ----------
    extra : str
        One of `EXTRAS`.
    what : str
        What needs it, for the message.

    Raises
    ------
    UsageError
        Names the packages that are missing, and the command that installs them.
    """
    if extra == "report":
        silence_matplotlib()
    missing = [name for name in EXTRAS[extra] if not _loads(name)]
    if missing:
        raise UsageError(f"{what} needs the extra {extra}: {install_command(*missing)}")


def _loads(name: str) -> bool:
    try:
        import_module(name)
    except ImportError:
        return False
    return True


def install_command(*packages: str) -> str:
    """Return the command that installs packages where this rollcli is installed: with pipx, or by pip."""
    if (Path(sys.prefix) / "pipx_metadata.json").is_file():
        return shlex.join(["pipx", "inject", "rollcli", *packages])
    return shlex.join([sys.executable or "python", "-m", "pip", "install", *packages])
