"""A cluster whose connections are encrypted, by Dask's own settings."""

import shlex
import shutil
import subprocess
from importlib.util import find_spec

import pytest

from tests.run.workers.test_cluster import Cluster
from tests.run_cli import rollcli, write_maps

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("distributed") is None, reason="the extra cluster is not installed"),
    pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make certificates with"),
]


def certificate(folder, name):
    """A certificate that vouches for itself, and its key."""
    cert, key = folder / f"{name}.pem", folder / f"{name}.key"
    line = shlex.split("openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=localhost")
    subprocess.run([*line, "-out", cert, "-keyout", key], check=True, capture_output=True)
    return cert, key


def settings(cert, key, trusted):
    """Dask's settings as variables: everyone has this certificate, and trusts one."""
    tls = {
        f"{role}__{what}": path
        for role in ("SCHEDULER", "WORKER", "CLIENT")
        for what, path in (("CERT", cert), ("KEY", key))
    }
    tls["CA_FILE"] = trusted
    named = {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(path) for name, path in tls.items()}
    return {**named, "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}


@pytest.fixture
def cluster(tmp_path):
    """The address of a scheduler with workers, and the settings of who may take part."""
    variables = settings(*certificate(tmp_path, "node"), tmp_path / "node.pem")
    encrypted = Cluster(tmp_path, "--protocol", "tls", **variables)
    try:
        encrypted.workers()
        yield encrypted.address, variables
    finally:
        encrypted.end()


def test_a_run_on_an_encrypted_cluster_gives_the_same_rows_and_a_stranger_is_refused(tmp_path, cluster):
    address, variables = cluster
    assert address.startswith("tls://")
    write_maps(tmp_path / "maps", 3)
    rollcli("estimate", "maps", "-q", "-o", "local.csv", cwd=tmp_path)

    done = rollcli(
        "estimate", "maps", "-q", "-o", "far.csv", "--scheduler", address, cwd=tmp_path, **variables
    )

    assert (done.status, done.err) == (0, "")
    assert (tmp_path / "far.csv").read_bytes() == (tmp_path / "local.csv").read_bytes()
    stranger = settings(*certificate(tmp_path, "stranger"), tmp_path / "node.pem")
    for others in (stranger, {}):
        refused = rollcli("estimate", "maps", "-o", "no.csv", "--scheduler", address, cwd=tmp_path, **others)
        assert refused.status in (1, 2)
        assert address in refused.err
        assert refused.err.count("\n") == 1
        assert not (tmp_path / "no.csv").exists()
