"""A web server on this machine, for tests."""

import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit


def response(status: int, data: bytes = b"", length: int | None = None) -> bytes:
    """An answer; its head may say another length than it has."""
    length = len(data) if length is None else length
    head = f"HTTP/1.1 {status} {HTTPStatus(status).phrase}\r\nContent-Length: {length}\r\n\r\n"
    return head.encode() + data


@contextlib.contextmanager
def web_server(answer: Callable[[str], bytes | Iterable[bytes]]) -> Iterator[tuple[str, list[str]]]:
    """Start a server that answers what it is asked for; yield its address, and what it was asked for.

    An answer of several pieces is sent piece by piece, to its end or until nobody reads it any more.
    """
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            given = answer(self.path)
            with contextlib.suppress(ConnectionError):
                for piece in [given] if isinstance(given, bytes) else given:
                    self.wfile.write(piece)

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}", asked
        server.shutdown()


def file_below(folder: Path, asked: str) -> bytes:
    """The answer of a server that has the files of a folder."""
    path = folder / unquote(urlsplit(asked).path).lstrip("/")
    return response(200, path.read_bytes()) if path.is_file() else response(404)
