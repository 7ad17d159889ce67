"""Objects of s3, gs and az through obstore (extra `storage`), and why a store refused."""

import contextlib
import os
import re
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from functools import lru_cache
from typing import Any, TypeVar

from rollcli.errors import InputError, OutputError, RollcliError, UsageError
from rollcli.extras import require_extra
from rollcli.files.bounded import MOST_BYTES, in_words, too_large
from rollcli.files.stores.locations import public_name, split_url, wait_for_room, waiting_for_network

TIMEOUT_VARIABLE = "ROLLCLI_STORE_TIMEOUT"  # seconds a request may take
_REQUEST_S = 60.0  # a map of 10 MB at 1.4 Mbit/s takes as long
DENIED = "access is denied; check the rights of these keys"
NO_OBJECT = "there is no such object"
_CUT = "the answer of the store was cut short"
_REFUSED = "the store refused the request"
_ANSWERED = "the store answered"
_TOO_LONG = f"the store takes too long; {TIMEOUT_VARIABLE} sets the seconds it may take"
_ELSEWHERE = "the bucket is in another region; set AWS_REGION"
_NO_KEYS = r"169\.254\.169\.254|metadata\.google\.internal"  # where machines of a cloud find theirs
_REDIRECT = "Received redirect without LOCATION|301 Moved Permanently"
_MISSING = "missing: "  # stands before what is said of an object that is not there
# what stores say, and what it means: the first that fits
_MEANINGS = {
    "<Code>(NoSuchBucket|ContainerNotFound)<": "there is no such bucket",
    "<Code>AccessDenied<": DENIED,
    "<Code>InvalidAccessKeyId<": "the access key is unknown; check AWS_ACCESS_KEY_ID",
    "<Code>SignatureDoesNotMatch<": "the secret key is wrong; check AWS_SECRET_ACCESS_KEY",
    "<Code>(ExpiredToken|InvalidAuthenticationInfo)<": "the keys have expired; fetch new ones",
    "<Code>AuthenticationFailed<": "the keys are wrong or have expired; check AZURE_STORAGE_ACCOUNT_KEY",
    "<Code>RequestTimeTooSkewed<": "this machine's clock differs from the store's; set it",
    "<Code>(PermanentRedirect|AuthorizationHeaderMalformed|IllegalLocationConstraintException)<": _ELSEWHERE,
    f"^{_MISSING}": NO_OBJECT,
    _NO_KEYS: "no keys are given; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or the store's own",
    _REDIRECT: _ELSEWHERE,
    "MissingAccount": "no account is given; set AZURE_STORAGE_ACCOUNT_NAME",
    "non-2xx status code: 401": "the keys are not accepted; check them",
    "non-2xx status code: 403": DENIED,
    r"non-2xx status code: (\d+)": rf"{_ANSWERED} \1",
    "kind: Timeout": _TOO_LONG,
    "error sending request|onnect": "the store does not answer; check the network and the endpoint",
    "body": _CUT,
    "": _REFUSED,
}
# what holds names of buckets and objects, which say nothing of what is wrong
_PATH, _ELEMENT = re.compile(r"(https?://[^/\s\"]*)[^\s\"]*"), re.compile(r"<(?!/?Code>)[^<>]*>[^<]*")
_STATUS = re.compile(r"non-2xx status code: (\d+)")


def request_seconds() -> float:
    """Return how long a request to a store or a web server may take as a whole.

    Raises
    ------
    UsageError
        The variable holds no number of seconds.
    """
    text = os.environ.get(TIMEOUT_VARIABLE, "")
    try:
        seconds = float(text) if text else _REQUEST_S
    except ValueError:
        seconds = 0.0
    if not 0 < seconds < 1e6:
        raise UsageError(f"{TIMEOUT_VARIABLE}={text}: give seconds, such as 60")
    return seconds


def within_seconds(seconds: float) -> str:
    """Say how long the bytes of one answer may take, behind how many they may be."""
    return f", within {seconds:g} s ({TIMEOUT_VARIABLE} sets them)"


def reason_of(error: Exception) -> str:
    """Say what a store objects to."""
    text = (_MISSING if isinstance(error, FileNotFoundError) else "") + _without_names(error)
    fitting = ((re.search(said, text), meaning) for said, meaning in _MEANINGS.items())
    return next(found.expand(meaning) for found, meaning in fitting if found)


def _without_names(error: Exception) -> str:
    """Return what an error says without names of buckets and objects: hosts stay, and codes of answers."""
    return _ELEMENT.sub("", _PATH.sub(r"\1", str(error)))


def is_final(error: Exception) -> bool:
    """Tell whether a store would answer the same again: it has understood the request and refuses it."""
    text = _without_names(error)
    if re.search(f"{_REDIRECT}|{_NO_KEYS}", text):
        return True
    status = _STATUS.search(text)
    passing = "<Code>RequestTimeout</Code>" in text or (status and status[1] in ("408", "429"))
    return status is not None and status[1].startswith("4") and not passing


def holds_for_all(reason: str) -> bool:
    """Tell whether what a store objects to holds for every object of its bucket."""
    of_one = reason in (DENIED, NO_OBJECT, _CUT, _REFUSED) or reason.startswith(_ANSWERED)
    return not of_one


Value = TypeVar("Value")

_CONNECT_S = 5
_RETRIES = 6  # by obstore: answers 5xx and refused connections
_RETRY_S = 60
_PAGE = 1000
_TRIES = 4  # by this module: a body that is cut in the middle, and an answer that is lost
_FIRST_PAUSE_S = 0.2
_OWNER = "rollcli-run"  # attribute of an object: who wrote it


def read_object(url: str, most: int = MOST_BYTES) -> tuple[bytes, str]:
    """Return the bytes of an object, and its entity tag; that is empty where the store has none.

    Raises
    ------
    InputError
        There is no such object, it has more bytes than `most`, it may not be read, or the store does not
        answer.
    """
    store, key = _open(url)

    def fetch() -> tuple[bytes, str]:
        answer = store.get(key)
        meta = answer.meta  # which some versions no longer tell once the bytes are taken
        if meta["size"] > most:
            raise too_large(public_name(url), meta["size"], most, within_seconds(request_seconds()))
        wait_for_room(meta["size"])
        return bytes(answer.bytes()), meta["e_tag"] or ""

    limits = f" ({request_seconds():g}), for up to {in_words(most)}"
    with _telling(url, "read", InputError, limits), waiting_for_network():
        return _repeated(fetch)


def write_object(url: str, data: bytes, owner: str = "", mode: str = "overwrite") -> None:
    """Write an object, whole or not at all; an existing one is replaced. `owner` names who writes.

    Raises
    ------
    OutputError
        The store does not take it.
    """
    store, key = _open(url)
    attributes = {_OWNER: owner} if owner else None
    with _telling(url, "written", OutputError), waiting_for_network():
        _repeated(lambda: store.put(key, data, mode=mode, attributes=attributes))


def create_object(url: str, data: bytes, owner: str) -> bool:
    """Write an object unless there is one of this name; return whether this owner wrote it."""
    from obstore.exceptions import AlreadyExistsError

    try:
        write_object(url, data, owner, mode="create")
    except AlreadyExistsError:
        return object_owner(url) == owner
    return True


def object_owner(url: str) -> str:
    """Return who wrote an object; empty where it does not say, or where there is none.

    Raises
    ------
    InputError
        The store does not answer, or does not let us look.
    """
    store, key = _open(url)
    with _telling(url, "read", InputError), contextlib.suppress(FileNotFoundError):
        return str(_repeated(lambda: store.get(key).attributes.get(_OWNER, "")))
    return ""


def problem_of(url: str, *, writes: bool) -> str:
    """Say what keeps an object from being read, or what lies below a prefix from being written.

    It keeps others, too, probably. Empty where nothing is known to.

    Raises
    ------
    UsageError
        The extra `storage` is not installed, or the store's settings are wrong.
    """
    store, key = _open(url)
    from obstore.exceptions import BaseError

    try:
        if writes:
            next(iter(store.list(key.rstrip("/") or None, chunk_size=1)), None)
        else:
            store.get_range(key, start=0, length=1)
    except (BaseError, OSError, RuntimeError) as error:
        reason = reason_of(error)
        return reason if holds_for_all(reason) or (reason == DENIED and not writes) else ""
    return ""


def remove_object(url: str) -> None:
    """Remove an object; none of this name is no error.

    Raises
    ------
    OutputError
        The store does not let us.
    """
    store, key = _open(url)
    with _telling(url, "removed", OutputError), contextlib.suppress(FileNotFoundError), waiting_for_network():
        _repeated(lambda: store.delete(key))


def list_objects(url: str) -> Iterator[tuple[str, int, str]]:
    """Yield URL, size and entity tag of each object below a prefix, in the store's order.

    Parameters
    ----------
    url : str
        ``s3://bucket/folder/``; the prefix ends at a slash, as a folder's name does.

    Raises
    ------
    UsageError
        There is no such bucket, or it may not be listed.
    """
    store, prefix = _open(url)
    root = url[: len(split_url(url)[0])]  # as it is written: a scheme may be in capitals
    with _telling(url, "listed", UsageError):
        for found in _listed(store, prefix.rstrip("/") or None):
            yield f"{root}/{found['path']}", found["size"], found["e_tag"] or ""


def has_objects(url: str) -> bool:
    """Return whether objects are seen below a prefix, which ends at a slash."""
    with contextlib.suppress(UsageError):  # who reads there says what is wrong
        return next(list_objects(url), None) is not None
    return False


def _listed(store: Any, prefix: str | None) -> Iterator[Any]:
    """Yield what a store says of each object; a listing that is cut continues after the last name."""
    last: str | None = None
    pages: Iterator[Any] | None = None

    def page() -> Any:
        nonlocal pages
        pages = pages or iter(store.list(prefix, offset=last, chunk_size=_PAGE))
        try:
            return next(pages, ())
        except Exception:
            pages = None
            raise

    while found := _repeated(page):
        yield from found
        last = found[-1]["path"]


@contextlib.contextmanager
def _telling(url: str, done: str, error: type[RollcliError], limits: str = "") -> Iterator[None]:
    """Turn what a store objects to into an error of ours: what cannot be `done`, and why."""
    from obstore.exceptions import AlreadyExistsError, BaseError

    try:
        yield
    except AlreadyExistsError:  # an answer, not a fault
        raise
    except (BaseError, OSError, RuntimeError) as fault:
        reason = reason_of(fault)
        cannot = "" if isinstance(fault, FileNotFoundError) else f"cannot be {done}: "
        more = limits if reason == _TOO_LONG else ""
        raise error(f"{public_name(url)}: {cannot}{reason}{more}", reason) from None


def _repeated(fetch: Callable[[], Value]) -> Value:
    """Call `fetch` again when an answer of a store is lost or cut short on its way."""
    from obstore.exceptions import GenericError

    give_up = time.monotonic() + _RETRY_S
    return repeated(fetch, lambda error: isinstance(error, GenericError) and not is_final(error), give_up)


def repeated(fetch: Callable[[], Value], may_pass: Callable[[Exception], bool], give_up: float) -> Value:
    """Call `fetch` again, after growing pauses and up to a moment, as long as what it raises may pass."""
    for attempt in range(_TRIES - 1):
        try:
            return fetch()
        except Exception as error:
            pause = _FIRST_PAUSE_S * 4**attempt
            if not may_pass(error) or time.monotonic() + pause > give_up:
                raise
        time.sleep(pause)
    return fetch()


def _open(url: str) -> tuple[Any, str]:
    root, key = split_url(url)
    return _store(root, os.getpid()), key


@lru_cache(maxsize=64)
def _store(root: str, process: int) -> Any:
    """Open a bucket; its endpoint and keys come from the environment. `process` keeps forks apart."""
    require_extra("storage", f"{root}:")
    from obstore.exceptions import BaseError
    from obstore.store import from_url

    seconds = request_seconds()
    client = {"connect_timeout": f"{_CONNECT_S}s", "timeout": f"{seconds:g}s"}
    endpoint = os.environ.get("AWS_ENDPOINT_URL", os.environ.get("AWS_ENDPOINT", ""))
    if endpoint.startswith("http://"):
        client["allow_http"] = "true"
    elif endpoint and not endpoint.startswith("https://") and root[:2].lower() == "s3":
        # obstore panics there
        raise UsageError("AWS_ENDPOINT_URL: is no address; write it as https://host, or http://host:9000")
    retry: Any = {"max_retries": _RETRIES, "retry_timeout": timedelta(seconds=max(_RETRY_S, 2 * seconds))}
    try:
        return from_url(root, client_options=client, retry_config=retry)  # type: ignore[call-overload]
    except (BaseError, ValueError) as error:
        raise UsageError(f"{root}: cannot be opened: {reason_of(error)}") from None
