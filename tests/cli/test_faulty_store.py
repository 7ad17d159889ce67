"""A store that fails now and then changes nothing but the time that a run takes."""

import pytest

from rollcli.files.storage import read_bytes
from tests.object_store import joined, upload
from tests.run_cli import contents, rollcli, write_maps
from tests.store_proxy import Faults, proxied

pytestmark = pytest.mark.slow

MAPS = 80


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Maps on disk, with their rows and de-rotated images."""
    folder = tmp_path_factory.mktemp("local")
    write_maps(folder / "maps", MAPS, width=80, height=60)
    assert rollcli("estimate", "maps", "-o", "rolls.csv", "--derotated", "level", cwd=folder).status == 0
    return folder


def test_requests_that_fail_change_no_byte_of_a_result(store, bucket, local):
    upload(local / "maps", f"{bucket}/maps")
    faults = Faults(0.05, seed=1)
    line = ("estimate", f"{bucket}/maps", "-o", f"{bucket}/rolls.csv", "--derotated", f"{bucket}/level")
    with proxied(store["AWS_ENDPOINT_URL"], faults) as address:
        variables = {**store, "AWS_ENDPOINT_URL": address, "ROLLCLI_STORE_TIMEOUT": "1"}
        done = rollcli(*line, "--part-rows", "20", "-j", "2", cwd=local, **variables)
    assert done.status == 0, done.err
    assert min(faults.counts[kind] for kind in ("500", "503", "cut", "never")) > 0, faults.counts
    rows = (local / "rolls.csv").read_bytes().replace(b"maps/", f"{bucket}/maps/".encode())
    assert joined(f"{bucket}/rolls.csv") == rows
    for name, data in contents(local / "level").items():
        assert read_bytes(f"{bucket}/level/{name}") == data
