"""Single files of web servers; signed addresses work, and are never shown."""

import http.client
import time
import urllib.error
import urllib.request

from rollcli.errors import InputError
from rollcli.files.bounded import MOST_BYTES, in_words, too_large
from rollcli.files.stores.locations import public_name, store_of, wait_for_room, waiting_for_network
from rollcli.files.stores.objects import TIMEOUT_VARIABLE, repeated, request_seconds, within_seconds

_PIECE = 2**20  # bytes
_PASSWORD = "servers are asked without user and password; take them out of the URL, or sign it"


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
    if "@" in store_of(url):
        raise InputError(f"{public_name(url)}: cannot be read: {_PASSWORD}", _PASSWORD)
    seconds = request_seconds()
    give_up = time.monotonic() + seconds
    try:
        with waiting_for_network():
            return repeated(lambda: _fetched(url, give_up, most, within_seconds(seconds)), _may_pass, give_up)
    except (OSError, http.client.HTTPException, ValueError) as error:
        reason = _reason(error, seconds, most)
    raise InputError(f"{public_name(url)}: cannot be read: {reason}", reason)


def _may_pass(error: Exception) -> bool:
    """Tell whether a server may answer otherwise when it is asked again; of no address none does."""
    if isinstance(error, urllib.error.HTTPError):
        return error.code >= 500
    broken = isinstance(error, OSError | http.client.HTTPException)
    return broken and not isinstance(error, http.client.InvalidURL)


def web_problem(url: str) -> str:
    """Say why a server refuses a file that it may have; empty where it does not refuse it."""
    if "@" in store_of(url):
        return _PASSWORD
    try:
        request = urllib.request.Request(url, headers={"Range": "bytes=0-0"})
        urllib.request.urlopen(request, timeout=request_seconds()).close()
    except urllib.error.HTTPError as error:
        if error.code in (400, 401, 403):  # Amazon answers 400 when temporary keys have expired
            return f"{_answered(error)}; the signature of the URL may have expired"
    except (OSError, http.client.HTTPException, ValueError):
        pass  # reading it says what is wrong
    return ""


def _fetched(url: str, give_up: float, most: int, within: str) -> bytes:
    with urllib.request.urlopen(url, timeout=max(give_up - time.monotonic(), 0.001)) as answer:
        if not isinstance(answer, http.client.HTTPResponse):  # Python follows a redirect to FTP
            raise http.client.HTTPException
        size, data = answer.length, bytearray()
        if size is not None and size > most:
            raise too_large(public_name(url), size, most, within)
        wait_for_room(size or 0)
        left = most + 1 if size is None else size
        # what has come is taken at once: Python bounds the time of each wait, and not of their sum
        while left and (piece := answer.read1(min(_PIECE, left))):
            data += piece
            left -= len(piece)
            if time.monotonic() > give_up:
                raise TimeoutError
    if len(data) > most:
        raise too_large(public_name(url), None, most, within)
    if left and size is not None:  # a body that is cut ends as one that is whole
        raise http.client.IncompleteRead(bytes(data), left)
    return bytes(data)


def _answered(error: urllib.error.HTTPError) -> str:
    return f"the server answered {error.code} {error.reason}"


def _reason(error: Exception, seconds: float, most: int) -> str:
    if isinstance(error, urllib.error.HTTPError):
        return _answered(error)
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
