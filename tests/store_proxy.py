"""A proxy before an object store: it delays requests, fails some of them, or answers in the store's place."""

import asyncio
import contextlib
import re
import threading
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

PASS, CUT, NEVER = "pass", "cut", "never"
Treatment = str | bytes  # one of these, or the whole answer that the store does not give
_LENGTH = re.compile(rb"\r\ncontent-length: *(\d+)", re.IGNORECASE)


def answer(status: str, code: str = "", *headers: str) -> bytes:
    """An answer as S3 gives it: `status` such as "403 Forbidden", with an error's XML where it has a code."""
    body = f'<?xml version="1.0"?><Error><Code>{code}</Code><Message>no</Message></Error>' if code else ""
    lines = (f"HTTP/1.1 {status}", "Content-Type: application/xml", f"Content-Length: {len(body)}", *headers)
    return ("\r\n".join(lines) + "\r\n\r\n" + body).encode()


class Faults:
    """Fails a fixed share of requests, each kind of fault in turn.

    Which requests fail depends on their names and on how often each was sent, not on their order.

    Attributes
    ----------
    counts : Counter
        How many requests each treatment got.
    """

    KINDS = (answer("500 Internal Server Error", "InternalError"), answer("503 Slow Down", "SlowDown"), CUT)

    def __init__(self, share: float, seed: int) -> None:
        self.counts: Counter[str] = Counter()
        self._share, self._seed = share, seed
        self._sent: Counter[str] = Counter()
        self._failed = 0

    def __call__(self, method: str, target: str) -> Treatment:
        """Decide about a request."""
        name = f"{method} {target}"
        self._sent[name] += 1
        drawn = zlib.crc32(f"{self._seed} {self._sent[name]} {name}".encode()) / 2**32
        kind: Treatment = PASS
        if drawn < self._share:
            kinds = (*self.KINDS, NEVER)
            kind = kinds[self._failed % len(kinds)]
            self._failed += 1
        self.counts[kind if isinstance(kind, str) else kind[9:12].decode()] += 1
        return kind


@contextlib.contextmanager
def proxied(
    endpoint: str, treat: Callable[[str, str], Treatment] = lambda *_: PASS, delay_s: float = 0.0
) -> Iterator[str]:
    """Start the proxy; yield its address.

    Parameters
    ----------
    endpoint : str
        The address of the store.
    treat : callable
        Decides about each request, from its method and its target.
    delay_s : float
        Time that each request waits before it is passed on, seconds.
    """
    loop, ready, address = asyncio.new_event_loop(), threading.Event(), []
    proxy = _Proxy(endpoint, treat, delay_s)

    async def serve() -> None:
        server = await asyncio.start_server(proxy.serve, "127.0.0.1", 0, limit=2**20, backlog=500)
        address.append(f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}")
        ready.set()
        await proxy.stopped.wait()
        server.close()
        while tasks := asyncio.all_tasks() - {asyncio.current_task()}:  # one that accepts begins another
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    thread = threading.Thread(target=lambda: loop.run_until_complete(serve()), daemon=True)
    thread.start()
    ready.wait()
    try:
        yield address[0]
    finally:
        loop.call_soon_threadsafe(proxy.stopped.set)
        thread.join()
        loop.close()


class _Proxy:
    def __init__(self, endpoint: str, treat: Callable[[str, str], Treatment], delay_s: float) -> None:
        parts = urlsplit(endpoint)
        self.stopped = asyncio.Event()
        self._store = parts.hostname, parts.port
        self._treat, self._delay_s = treat, delay_s

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Take the requests of one connection."""
        try:
            while await self._take(reader, writer):
                await writer.drain()
        except (asyncio.IncompleteReadError, ConnectionError, asyncio.CancelledError):
            pass  # whoever asked has gone, or the test is over
        finally:
            writer.close()

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Take one request; return whether the connection goes on."""
        head = await reader.readuntil(b"\r\n\r\n")
        length = _LENGTH.search(head)
        body = await reader.readexactly(int(length[1]) if length else 0)
        method, target, _ = head.split(b" ", 2)
        how = self._treat(method.decode(), target.decode())
        await asyncio.sleep(self._delay_s)
        if isinstance(how, bytes):
            writer.write(how)
            return True
        given = await self._forwarded(head, body)
        if how == NEVER:
            await reader.read()  # until the other side gives up
        elif how == CUT:  # an answer without a body is lost, though the store has done what was asked
            start = given.index(b"\r\n\r\n") + 4
            writer.write(given[: start + (len(given) - start) // 2] if len(given) > start else b"")
            await writer.drain()
        else:
            writer.write(given)
        return False

    async def _forwarded(self, head: bytes, body: bytes) -> bytes:
        """Return the store's answer, which ends with its connection."""
        reader, writer = await asyncio.open_connection(*self._store)
        try:
            writer.write(head[:-2] + b"Connection: close\r\n\r\n" + body)
            await writer.drain()
            return await reader.read()
        finally:
            writer.close()
