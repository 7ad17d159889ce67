"""Single files of web servers; signed addresses work, and are never shown."""

import http.client
import io
import socket
import time
import urllib.error
import urllib.request
from functools import partial
from typing import Any

from rollcli.errors import InputError
from rollcli.files.bounded import MOST_BYTES, in_words, too_large
from rollcli.files.stores.locations import public_name, wait_for_room, waiting_for_network
from rollcli.files.stores.objects import TIMEOUT_VARIABLE, request_seconds, within_seconds

_TRIES = 4
_FIRST_PAUSE_S = 0.2
_PIECE = 2**20  # bytes


def read_web_file(url: str, most: int = MOST_BYTES) -> bytes:
    """Return the bytes behind an http or https URL.

    Parameters
    ----------
    url : str
    most : int
        Bytes that are read.

    Raises
    ------
    InputError
        There is no such file, it may not be read, it has more bytes, or the server does not answer, or takes
        longer than `ROLLCLI_STORE_TIMEOUT` seconds for the whole of it.
    UsageError
        That variable holds no number of seconds.
    """
    seconds = request_seconds()
    give_up = time.monotonic() + seconds
    for attempt in range(_TRIES):
        try:
            with waiting_for_network():
                return _fetched(url, give_up, most, within_seconds(seconds))
        except urllib.error.HTTPError as error:
            reason, final = f"the server answered {error.code} {error.reason}", error.code < 500
        except (OSError, http.client.HTTPException, ValueError) as error:
            reason = _reason(error, seconds, most)
            final = isinstance(error, ValueError | http.client.InvalidURL)  # no address, whoever is asked
        pause = _FIRST_PAUSE_S * 4**attempt
        if final or time.monotonic() + pause > give_up:
            break
        time.sleep(pause)
    raise InputError(f"{public_name(url)}: cannot be read: {reason}", reason)


def web_problem(url: str) -> str:
    """Say why a server refuses a file that it may have; empty where it does not refuse it."""
    try:
        request = urllib.request.Request(url, headers={"Range": "bytes=0-0"})
        _opened(request, time.monotonic() + request_seconds()).close()
    except urllib.error.HTTPError as error:
        if error.code in (400, 401, 403):  # Amazon answers 400 when temporary keys have expired
            answer = f"the server answered {error.code} {error.reason}"
            return f"{answer}; the signature of the URL may have expired"
    except (OSError, http.client.HTTPException, ValueError):
        pass  # reading it says what is wrong
    return ""


def _fetched(url: str, give_up: float, most: int, within: str) -> bytes:
    with _opened(urllib.request.Request(url), give_up) as answer:
        if answer.length is not None and answer.length > most:
            raise too_large(public_name(url), answer.length, most, within)
        wait_for_room(answer.length or 0)
        data = bytearray()
        while piece := answer.read(_PIECE):
            data += piece
            if len(data) > most:  # of an answer that does not say its length
                raise too_large(public_name(url), None, most, within)
        if answer.length:  # a bounded read of a body that is cut ends as one that is whole
            raise http.client.IncompleteRead(bytes(data), answer.length)
    return bytes(data)


def _opened(request: urllib.request.Request, give_up: float) -> Any:
    """Open a URL; whatever is read of the answers to it, of those that redirect too, is read in time."""
    opener = urllib.request.build_opener(_Handler(give_up), _Redirects)
    return opener.open(request, timeout=max(give_up - time.monotonic(), 0.001))


class _Handler(urllib.request.HTTPHandler, urllib.request.HTTPSHandler):
    """Takes the place of both handlers."""

    def __init__(self, give_up: float) -> None:
        super().__init__()
        self._give_up = give_up

    def http_open(self, req: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(partial(_connection, http.client.HTTPConnection, self._give_up), req)

    def https_open(self, req: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(partial(_connection, http.client.HTTPSConnection, self._give_up), req)


class _Redirects(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, req: Any, fp: Any, code: Any, msg: Any, headers: Any, newurl: str) -> Any:
        if not newurl.lower().startswith(
            ("http://", "https://")
        ):  # Python would go on to FTP, which no limit of time holds for
            raise http.client.HTTPException
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _connection(kind: Any, give_up: float, host: str, **settings: Any) -> http.client.HTTPConnection:
    def answer(sock: socket.socket, **more: Any) -> http.client.HTTPResponse:
        return http.client.HTTPResponse(_InTime(sock, give_up), **more)  # type: ignore[arg-type]

    connection: http.client.HTTPConnection = kind(host, **settings)
    connection.response_class = answer  # type: ignore[assignment]
    return connection


class _InTime(io.RawIOBase):
    """Stands for a socket where an answer is read: Python bounds each read alone, and never their sum."""

    def __init__(self, sock: socket.socket, give_up: float) -> None:
        self._sock, self._give_up = sock, give_up
        self._raw = sock.makefile("rb", buffering=0)

    def makefile(self, mode: str) -> io.BufferedReader:
        return io.BufferedReader(self)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int | None:
        left = self._give_up - time.monotonic()
        if left <= 0:
            raise TimeoutError
        self._sock.settimeout(left)
        return self._raw.readinto(buffer)

    def close(self) -> None:
        self._raw.close()
        super().close()


def _reason(error: Exception, seconds: float, most: int) -> str:
    if isinstance(error, TimeoutError) or "timed out" in str(error):
        limits = f"({seconds:g}), for up to {in_words(most)}"
        return f"the server takes too long; {TIMEOUT_VARIABLE} sets the seconds it may take {limits}"
    if isinstance(error, http.client.IncompleteRead):
        return "the answer of the server was cut short"
    if isinstance(error, urllib.error.URLError):
        return "the server does not answer"
    if isinstance(error, ValueError):
        return "this is no address"  # what Python says of it would show its password or its signature
    return "the server does not answer as one of the web does"
