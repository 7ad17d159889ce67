"""What is asked of an object store that answers as it is told to, and what is made of its answers."""

import itertools
import os
from functools import partial
from unittest import mock
from urllib.parse import parse_qsl, unquote, urlsplit

import pytest

from rollcli.errors import RollcliError
from rollcli.files.stores import objects
from tests.object_store import KEYS
from tests.store_proxy import answer, proxied

URL = "s3://maps/p/a.png"
_DATED = ("Last-Modified: Mon, 02 Jan 2023 03:04:05 GMT", 'ETag: "tag"')


def _object(data="12345", *headers, length=None, status="200 OK"):
    """An answer with an object's bytes, of which it may promise more."""
    length = len(data) if length is None else length
    lines = (f"HTTP/1.1 {status}", f"Content-Length: {length}", *(headers or _DATED))
    return ("\r\n".join(lines) + "\r\n\r\n" + data).encode()


def _listing(*names, then=""):
    """An answer with a page of a listing; `then` says where the next one begins."""
    found = "".join(
        f"<Contents><Key>{name}</Key><LastModified>2023-01-02T03:04:05.000Z</LastModified>"
        f"<ETag>&quot;{name}&quot;</ETag><Size>{len(name)}</Size></Contents>"
        for name in names
    )
    more = f"<NextContinuationToken>{then}</NextContinuationToken>" if then else ""
    cut = f"<IsTruncated>{'true' if then else 'false'}</IsTruncated>"
    body = f"<ListBucketResult><Name>maps</Name><KeyCount>{len(names)}</KeyCount>{cut}{more}{found}"
    body += "</ListBucketResult>"
    return f"HTTP/1.1 200 OK\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode()


OWNED = _object("5", *_DATED, "x-amz-meta-rollcli-run: me")
GONE = _object("<DeleteResult><Deleted><Key>p/a.png</Key></Deleted></DeleteResult>")
ANSWERS = {
    "yes": _object(),
    "owned": OWNED,
    "gone": GONE,
    "untagged": _object("5", _DATED[0], 'ETag: ""'),
    "part": _object("1", *_DATED, "Content-Range: bytes 0-0/5", status="206 Partial Content"),
    "broken": b"220 mail\r\n\r\n",
    "empty": _listing(),
    "page": _listing("p/a.png", "p/b c.png", then="token"),
    "last": _listing("p/d.png"),
    "no bucket": answer("404 Not Found", "NoSuchBucket"),
    "no object": answer("404 Not Found", "NoSuchKey"),
    "not there": answer("404 Not Found"),
    "denied": answer("403 Forbidden", "AccessDenied"),
    "forbidden": answer("403 Forbidden"),
    "who": answer("401 Unauthorized"),
    "unknown key": answer("403 Forbidden", "InvalidAccessKeyId"),
    "moved": answer("301 Moved Permanently", "PermanentRedirect"),
    "there": answer("412 Precondition Failed", "PreconditionFailed"),
    "wrong": answer("400 Bad Request", "InvalidArgument"),
    "later": answer("429 Too Many Requests", "SlowDown"),
    "waited": answer("400 Bad Request", "RequestTimeout"),
    "down": answer("500 Internal Server Error", "InternalError"),
    "slow": answer("503 Slow Down", "SlowDown"),
}
REFUSALS = (*list(ANSWERS)[list(ANSWERS).index("no bucket") :], "broken")
DOINGS = {
    "read": lambda: objects.read_object(URL),
    "read small": lambda: objects.read_object(URL, 4),
    "owner": lambda: objects.object_owner(URL),
    "exists": lambda: objects.object_exists(URL),
    "problem": lambda: objects.object_problem(URL),
    "problem of a folder": lambda: objects.folder_problem("s3://maps/p/"),
    "write": lambda: objects.write_object(URL, b"5", "me"),
    "create": lambda: objects.create_object(URL, b"5", "me"),
    "remove": lambda: objects.remove_object(URL),
    "list": lambda: list(objects.list_objects("s3://maps/p/")),
    "list all": lambda: list(objects.list_objects("s3://maps/")),
    "tags": lambda: list(objects.list_tags("s3://maps/p/")),
    "has": lambda: objects.has_objects("s3://maps/p/"),
}
ASKED = {
    "read": ("yes", "untagged"),
    "read small": ("yes", "untagged"),
    "owner": ("owned", "yes"),
    "exists": ("yes",),
    "problem": ("part",),
    "problem of a folder": ("empty", "last"),
    "write": ("yes",),
    "create": ("yes", "there owned", "there yes", "there not-there", "there denied"),
    "remove": ("gone",),
    "list": ("page last", "page later last", "page denied", "empty"),
    "list all": ("last",),
    "tags": ("page last",),
    "has": ("last", "empty"),
}


def _done(doing, kinds):
    """What a store that gives such answers, the last for ever, is asked, what comes of it, and the pauses."""
    pytest.importorskip("obstore", reason="obstore, of the extra storage, is not here")
    left, asked, pauses = [ANSWERS[each.replace("-", " ")] for each in kinds], [], []

    def treat(method, target):
        parts = urlsplit(target)
        query = " ".join(f"{name}={value}" for name, value in sorted(parse_qsl(parts.query)))
        asked.append(f"{method} {unquote(parts.path)} {query}".strip())
        return left.pop(0) if len(left) > 1 else left[0]

    with (
        proxied("http://127.0.0.1:9", treat) as address,
        mock.patch.dict(os.environ, {**KEYS, "AWS_ENDPOINT_URL": address}),
        mock.patch.object(objects, "_RETRIES", 0),  # which obstore waits for itself
        mock.patch.object(objects.time, "sleep", pauses.append),
    ):
        objects._store.cache_clear()
        try:
            found = DOINGS[doing]()
        except RollcliError as error:
            found = [type(error).__name__, str(error), error.code]
        finally:
            objects._store.cache_clear()
    found = [found[0].decode(), found[1]] if isinstance(found, tuple) else found
    times = [[request, len(list(some))] for request, some in itertools.groupby(asked)]
    return {"found": found, "asked": times, "pauses": pauses}


def _refused(doing):
    return {each: _done(doing, [each.replace(" ", "-")]) for each in REFUSALS}


def _opened(root, **variables):
    """How a store is opened."""
    store = pytest.importorskip("obstore.store", reason="obstore, of the extra storage, is not here")
    with (
        mock.patch.dict(os.environ, variables, clear=True),
        mock.patch.object(store, "from_url", lambda *given, **options: [given, options]),
    ):
        try:
            found = objects._store.__wrapped__(root, 1)
        except RollcliError as error:
            return str(error)
    retry = found[1]["retry_config"]
    return [*found, retry.pop("retry_timeout").total_seconds()]


# as obstore and its stores have them
ERRORS = (
    "Generic S3 error: error sending request for url (http://169.254.169.254/latest/api/token)",
    "error performing token request: http://metadata.google.internal/computeMetadata after 10 retries",
    "Generic MicrosoftAzure error: MissingAccount",
    "Generic S3 error: Received redirect without LOCATION, this normally indicates a wrong region",
    "Server returned non-2xx status code: 301 Moved Permanently: ",
    "Server returned non-2xx status code: 401 Unauthorized: ",
    "Server returned non-2xx status code: 403 Forbidden: <Error><Code>Other</Code></Error>",
    "Server returned non-2xx status code: 403 Forbidden: <Code>AccessDenied</Code>",
    "Server returned non-2xx status code: 400 Bad Request: <Code>RequestTimeout</Code>",
    "Server returned non-2xx status code: 408 Request Timeout: ",
    "Server returned non-2xx status code: 409 Conflict: <Key>401</Key><Code>Busy</Code>",
    "Server returned non-2xx status code: 429 Too Many Requests: ",
    "Server returned non-2xx status code: 503 Service Unavailable: <Code>SlowDown</Code>",
    "HTTP error: request or response body error for url (https://host/maps/a.png)",
    'Error { url: "http://host/<Code>AccessDenied</Code>", kind: Timeout }',
    "HTTP error: error sending request",
    "HTTP error: tcp Connect error",
    "HTTP error: client not connected",
    "Generic S3 error: no idea: http://host/body/connect",
    "<Code>NoSuchBucket</Code> <Message>no AccessDenied</Message>",
    "<Code>ContainerNotFound</Code>",
    "<Code>NoSuchKey</Code>",
)


def _judged(text):
    error = Exception(text)
    reason = objects.reason_of(error)
    said = [reason, objects.what_is_missing(error), objects.is_final(error)]
    return [*said, *map(objects.holds_for_all, said[:2])]


def _seconds(text):
    with mock.patch.dict(os.environ, {objects.TIMEOUT_VARIABLE: text}):
        try:
            return [objects.request_seconds(), objects.within_seconds(objects.request_seconds())]
        except RollcliError as error:
            return str(error)


CASES = {
    **{
        f"store: {doing}": partial(
            lambda doing: {each: _done(doing, each.split()) for each in ASKED[doing]}, doing
        )
        for doing in DOINGS
    },
    **{f"store: {doing}, refused": partial(_refused, doing) for doing in DOINGS},
    "store: opened": lambda: [
        _opened("s3://maps"),
        _opened("s3://maps", AWS_ENDPOINT_URL="http://x", ROLLCLI_STORE_TIMEOUT="0.5"),
        _opened("s3://maps", AWS_ENDPOINT="http://x", ROLLCLI_STORE_TIMEOUT="100"),
        _opened("s3://maps", AWS_ENDPOINT_URL="https://x", ROLLCLI_STORE_TIMEOUT="soon"),
    ],
    "store: errors": lambda: {each: _judged(each) for each in ERRORS},
    "store: seconds": lambda: [
        _seconds(each) for each in ("", "0", "0.25", "60", "1e6", "999999", "-1", "x", "nan")
    ],
}
