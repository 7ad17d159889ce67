"""An object store on this machine, for tests: moto's server in a process of its own."""

import contextlib
import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from rollcli.files.storage import list_names, read_bytes, write_bytes

KEYS = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_REGION": "us-east-1"}


@contextlib.contextmanager
def object_store() -> Iterator[dict[str, str]]:
    """Start the server; yield the environment that leads rollcli to it. It has the bucket `maps`."""
    pytest.importorskip("moto.server", reason="moto[server], the object store of the tests, is not here")
    pytest.importorskip("obstore", reason="obstore, of the extra storage, is not here")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    line = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    environment = {**os.environ, "PYTHONWARNINGS": "ignore"}
    with subprocess.Popen(
        line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    ) as server:
        try:
            endpoint = f"http://127.0.0.1:{port}"
            _wait_for(f"{endpoint}/moto-api/")
            request = urllib.request.Request(f"{endpoint}/maps", method="PUT")
            urllib.request.urlopen(request, timeout=10).close()
            yield {**KEYS, "AWS_ENDPOINT_URL": endpoint, "ROLLCLI_STORE_TIMEOUT": "5"}
        finally:
            server.kill()


def upload(folder: Path, url: str) -> None:
    """Copy every file below a folder to below a URL."""
    for path in folder.rglob("*"):
        if path.is_file():
            write_bytes(f"{url}/{path.relative_to(folder).as_posix()}", path.read_bytes())


def objects_below(place: str) -> dict[str, bytes]:
    """Every object or file below a URL or folder, by its relative name."""
    return {name: read_bytes(f"{place}/{name}") for name in list_names(place)}


def joined(url: str, ending: str = "csv") -> bytes:
    """Put the parts of a result below a URL together; or other objects, whose names end with `ending`."""
    names = sorted(name for name in list_names(url) if name.endswith(ending))
    return b"".join(read_bytes(f"{url}/{name}") for name in names)


def _wait_for(address: str) -> None:
    give_up = time.monotonic() + 30
    while True:
        try:
            urllib.request.urlopen(address, timeout=5).close()
            return
        except OSError:
            if time.monotonic() > give_up:
                raise
            time.sleep(0.1)
