"""Single files of web servers; signed addresses work, and are never shown."""

import http.client
import time
import urllib.error
import urllib.request

from rollcli.errors import InputError
from rollcli.files.stores.locations import public_name, wait_for_room, waiting_for_network

_TIMEOUT_S = 60.0
_TRIES = 4
_FIRST_PAUSE_S = 0.2
_LARGEST = 2**32


class _TooLargeError(OSError):
    """A file of more bytes than are read."""


def read_web_file(url: str) -> bytes:
    """Return the bytes behind an http or https URL.

    Raises
    ------
    InputError
        There is no such file, it may not be read, or the server does not answer.
    """
    for attempt in range(_TRIES):
        try:
            with waiting_for_network():
                return _fetched(url)
        except urllib.error.HTTPError as error:
            reason, final = f"the server answered {error.code} {error.reason}", error.code < 500
        except (OSError, http.client.HTTPException, ValueError) as error:
            reason, final = _reason(error), isinstance(error, (_TooLargeError, ValueError))
        if final:
            break
        time.sleep(_FIRST_PAUSE_S * 4**attempt)
    raise InputError(f"{public_name(url)}: cannot be read: {reason}")


def web_problem(url: str) -> str:
    """Say why a server refuses a file that it may have; empty where it does not refuse it."""
    request = urllib.request.Request(url, headers={"Range": "bytes=0-0"})
    try:
        urllib.request.urlopen(request, timeout=_TIMEOUT_S).close()
    except urllib.error.HTTPError as error:
        if error.code in (400, 401, 403):  # Amazon answers 400 when temporary keys have expired
            answer = f"the server answered {error.code} {error.reason}"
            return f"{answer}; the signature of the URL may have expired"
    except (OSError, http.client.HTTPException, ValueError):
        pass  # reading it says what is wrong
    return ""


def _fetched(url: str) -> bytes:
    with urllib.request.urlopen(url, timeout=_TIMEOUT_S) as answer:
        wait_for_room(answer.length or 0)
        data: bytes = answer.read(_LARGEST + 1)
        missing = answer.length
    if len(data) > _LARGEST:
        raise _TooLargeError
    if missing:  # a bounded read of a body that is cut ends as one that is whole
        raise http.client.IncompleteRead(data, missing)
    return data


def _reason(error: Exception) -> str:
    if isinstance(error, TimeoutError) or "timed out" in str(error):
        return "the server takes too long"
    if isinstance(error, http.client.IncompleteRead):
        return "the answer of the server was cut short"
    if isinstance(error, urllib.error.URLError):
        return "the server does not answer"
    if isinstance(error, _TooLargeError):
        return "it has more bytes than any disparity map"
    if isinstance(error, ValueError):
        return "this is no address"  # what Python says of it would show its password or its signature
    return "the server does not answer as one of the web does"
