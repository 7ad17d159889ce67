"""Each kind of request to a store is repeated when it fails for the network's sake."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from rollcli.files import storage
from rollcli.files.stores.objects import _listed, _store, list_objects
from tests.store_proxy import CUT, NEVER, PASS, Faults, proxied

pytestmark = pytest.mark.slow

DOINGS = {
    "read": lambda url: storage.read_bytes(url),
    "list": lambda url: list(list_objects(url.rpartition("/")[0])),
    "write": lambda url: storage.write_bytes(url, b"other"),
    "create": lambda url: storage.create(f"{url}2", b"new", "me"),
    "create what another has": lambda url: storage.create(url, b"new", "me"),
    "remove": lambda url: storage.remove(url),
}


@pytest.fixture(autouse=True)
def _opened_anew():
    """Forget the stores that were opened with another address, before and after."""
    _store.cache_clear()
    yield
    _store.cache_clear()


@pytest.mark.parametrize("kind", [*Faults.KINDS, NEVER], ids=["500", "503", CUT, NEVER])
def test_every_request_gives_the_same_when_it_fails_first(store, bucket, monkeypatch, kind):
    monkeypatch.setenv("ROLLCLI_STORE_TIMEOUT", "0.5")
    monkeypatch.setattr("rollcli.files.stores.objects._FIRST_PAUSE_S", 0.02)
    with proxied(store["AWS_ENDPOINT_URL"], treat := FirstFails(kind)) as address:
        monkeypatch.setenv("AWS_ENDPOINT_URL", address)
        wanted, found = (done_at_once(bucket, treat, fails=fails) for fails in (False, True))
    assert found == wanted
    assert treat.failed >= len(DOINGS)


def done_at_once(bucket, treat, *, fails):
    """What each doing says and leaves. All are done at once: their pauses and time-outs pass together."""
    urls = {doing: f"{bucket}/{doing}/map.png" for doing in DOINGS}
    for url in urls.values():
        storage.remove(f"{url}2")
        storage.write_bytes(url, b"12345" * 1000)
    treat.fails = fails
    with ThreadPoolExecutor(len(DOINGS)) as pool:
        said = dict(zip(DOINGS, pool.map(lambda doing: DOINGS[doing](urls[doing]), DOINGS), strict=True))
    treat.fails = False
    return said, {url: storage.read_bytes(url) for url, *_ in list_objects(f"{bucket}/")}


def test_a_listing_that_is_cut_continues_after_the_last_name(monkeypatch):
    exceptions = pytest.importorskip(
        "obstore.exceptions", reason="obstore, of the extra storage, is not here"
    )
    monkeypatch.setattr("rollcli.files.stores.objects._FIRST_PAUSE_S", 0.0)

    names = [f"p/{number}" for number in range(7)]

    class Store:
        """Seven objects, two a page; the third page is cut the first time."""

        cut = False

        def list(self, prefix, *, offset, chunk_size):
            """Yield the pages after a name."""
            rest = [name for name in names if offset is None or name > offset]
            for first in range(0, len(rest), 2):
                if first == 4 and not self.cut:
                    self.cut = True
                    raise exceptions.GenericError("cut")
                yield [{"path": name} for name in rest[first : first + 2]]

    assert [found["path"] for found in _listed(Store(), "p")] == names


class FirstFails:
    """The first request of each name fails, while `fails` is set."""

    def __init__(self, kind):
        self.fails, self.failed = False, 0
        self._kind, self._seen = kind, set()

    def __call__(self, method, target):
        """Decide about a request."""
        if not self.fails or (method, target) in self._seen:
            return PASS
        self._seen.add((method, target))
        self.failed += 1
        return self._kind
