"""What is asked of stores and web servers that answer as they are told to, and what is made of it."""

import itertools
import os
import socket
from functools import partial
from pathlib import Path
from unittest import mock
from urllib.parse import parse_qsl, unquote, urlsplit

import pytest

from rollcli.errors import RollcliError
from rollcli.files.stores import objects, web
from tests.object_store import KEYS
from tests.recorded import made
from tests.store_proxy import answer, proxied
from tests.web_server import response, web_server

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
# what is done, and the answers that are given one after the other, the last for ever
DOINGS = {
    "read": (lambda: objects.read_object(URL), "yes", "untagged"),
    "read small": (lambda: objects.read_object(URL, 4), "yes", "untagged"),
    "owner": (lambda: objects.object_owner(URL), "owned", "yes"),
    "problem": (lambda: objects.problem_of(URL, writes=False), "part"),
    "problem of a folder": (lambda: objects.problem_of("s3://maps/p/", writes=True), "empty", "last"),
    "write": (lambda: objects.write_object(URL, b"5", "me"), "yes"),
    "create": (
        lambda: objects.create_object(URL, b"5", "me"),
        *("yes", "there owned", "there yes", "there not-there", "there denied"),
    ),
    "remove": (lambda: objects.remove_object(URL), "gone"),
    "list": (
        lambda: list(objects.list_objects("s3://maps/p/")),
        *("page last", "page later last", "page denied", "empty"),
    ),
    "list all": (lambda: list(objects.list_objects("s3://maps/")), "last"),
    "has": (lambda: objects.has_objects("s3://maps/p/"), "last", "empty"),
}


def _done(doing, kinds):
    """What a store that gives such answers is asked, what comes of it, and the pauses."""
    pytest.importorskip("obstore", reason="obstore, of the extra storage, is not here")
    left, asked, pauses = [ANSWERS[each.replace("-", " ")] for each in kinds], [], []

    def treat(method, target):
        parts = urlsplit(target)
        query = " ".join(f"{name}={value}" for name, value in sorted(parse_qsl(parts.query)))
        # an older obstore asks for each object to be removed, a newer one for all of a list
        removes = doing == "remove" and method in ("DELETE", "POST")
        asked.append("DELETE" if removes else f"{method} {unquote(parts.path)} {query}".strip())
        return left.pop(0) if len(left) > 1 else left[0]

    with (
        proxied("http://127.0.0.1:9", treat) as address,
        mock.patch.dict(os.environ, {**KEYS, "AWS_ENDPOINT_URL": address}),
        mock.patch.object(objects, "_RETRIES", 0),  # which obstore waits for itself
        mock.patch.object(objects.time, "sleep", pauses.append),
    ):
        objects._store.cache_clear()
        try:
            found = DOINGS[doing][0]()
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


def _errors():
    texts = Path(__file__).with_name("errors.txt").read_text("utf-8").partition("\n\n")[2].splitlines()
    return {each: _judged(each.replace("\\n", "\n")) for each in texts}


def _judged(text):
    error = Exception(text)
    said = [objects.reason_of(error), objects.reason_of(FileNotFoundError(text)), objects.is_final(error)]
    return [*said, *map(objects.holds_for_all, said[:2])]


def _seconds(text):
    with mock.patch.dict(os.environ, {objects.TIMEOUT_VARIABLE: text}):
        return made(lambda: [objects.request_seconds(), objects.within_seconds(objects.request_seconds())])


MAP = b"a map" * 1000
PAGES = {"broken": b"220 mail.example.org\r\n", "cut": response(200, MAP[:100], len(MAP))}
SIGNED = "map.png?signature=secret"


def _of_web(ask, kinds, *given):
    """What a web server that gives such answers, the last for ever, is told to say, and the pauses."""
    left = [PAGES.get(each) or response(int(each), MAP) for each in kinds.split()]
    pauses = []
    with (
        web_server(lambda _: left.pop(0) if len(left) > 1 else left[0]) as (address, asked),
        mock.patch.object(web.time, "sleep", pauses.append),
    ):
        found = made(ask, f"{address}/{SIGNED}", *given)
    said = found.replace(address, "ADDRESS") if isinstance(found, str) else len(found)
    return [said, pauses, len(asked)]


def _of_silence():
    """What is said of a server that is silent, of one that is not there, and of no address."""
    with mock.patch.object(web.time, "sleep"):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            url = f"http://127.0.0.1:{silent.getsockname()[1]}"
            with mock.patch.dict(os.environ, {objects.TIMEOUT_VARIABLE: "0.05"}):
                said = [made(web.read_web_file, f"{url}/{SIGNED}")]
        addresses = (url, "http://[", "http://user:secret@[")
        said += [made(web.read_web_file, f"{each}/{SIGNED}") for each in addresses]
    return [each.replace(url, "ADDRESS") for each in said]


CASES = {
    **{
        f"store: {doing}": partial(
            lambda doing: {each: _done(doing, each.split()) for each in DOINGS[doing][1:]}, doing
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
    "store: errors": _errors,
    "store: seconds": lambda: [
        _seconds(each) for each in ("", "0", "0.25", "60", "1e6", "999999", "-1", "x", "nan")
    ],
    "web: read": lambda: {
        each: _of_web(web.read_web_file, each)
        for each in (
            *(f"{first} {first} {first} 200" for first in ("500", "503", "cut", "broken")),
            *("500", "cut", "broken", "400 200", "401 200", "403 200", "404 200", "410 200"),
        )
    },
    "web: too large": lambda: _of_web(web.read_web_file, "200", len(MAP) - 1),
    "web: problem": lambda: {
        each: _of_web(web.web_problem, each) for each in ["200", "404", "500", "400", "401", "403", "broken"]
    },
    "web: silence": _of_silence,
}
