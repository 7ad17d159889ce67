"""Files of web servers: what is asked again, and what is said of a server that does not give them."""

import contextlib
import socket

import pytest

from rollcli.errors import InputError
from rollcli.files.stores import web
from tests.web_server import response, web_server

DATA = b"a map" * 1000


ANSWERS = {"no web server": b"220 mail.example.org\r\n", "cut": response(200, DATA[:100], len(DATA))}


@pytest.fixture
def serve():
    """Starts a server that gives these answers, the last for ever; returns the URL of a file, signed."""
    with contextlib.ExitStack() as stack:

        def start(*answers):
            left = [ANSWERS.get(each) or response(each, DATA) for each in answers]
            served = web_server(lambda _: left.pop(0) if len(left) > 1 else left[0])
            return f"{stack.enter_context(served)[0]}/map.png?signature=secret"

        yield start


@pytest.fixture
def pauses(monkeypatch):
    """The pauses, seconds, which nobody waits for."""
    found = []
    monkeypatch.setattr(web.time, "sleep", found.append)
    return found


def refusal(url):
    """What is said of a file that cannot be read; its signature is never shown."""
    with pytest.raises(InputError) as caught:
        web.read_web_file(url)
    assert "secret" not in str(caught.value)
    return str(caught.value).partition(": cannot be read: ")[2]


@pytest.mark.parametrize("first", [500, 503, "cut", "no web server"])
def test_what_may_pass_is_asked_again_after_growing_pauses(serve, pauses, first):
    assert web.read_web_file(serve(first, first, first, 200)) == DATA
    assert pauses == pytest.approx([0.2, 0.8, 3.2])


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (500, "the server answered 500 Internal Server Error"),
        ("cut", "the answer of the server was cut short"),
        ("no web server", "the server does not answer as one of the web does"),
    ],
)
def test_what_does_not_pass_is_said(serve, pauses, answer, said):
    assert refusal(serve(answer)) == said


@pytest.mark.parametrize("status", [400, 401, 403, 404, 410])
def test_a_refusal_is_not_asked_again(serve, pauses, status):
    assert refusal(serve(status, 200)).startswith(f"the server answered {status} ")
    assert pauses == []


def test_no_address_and_a_file_without_end_are_said_at_once(serve, pauses):
    assert refusal("http://user:secret@[/map.png") == "this is no address"
    with pytest.raises(InputError, match="has 5000 bytes; up to 4999 bytes are read"):
        web.read_web_file(serve(200), len(DATA) - 1)
    assert pauses == []


def test_a_server_that_is_silent_or_not_there_is_said(pauses, monkeypatch):
    monkeypatch.setenv("ROLLCLI_STORE_TIMEOUT", "0.05")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/map.png?secret"
        assert refusal(url).startswith("the server takes too long; ROLLCLI_STORE_TIMEOUT ")
    assert refusal(url) == "the server does not answer"


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (200, ""),
        (404, ""),
        (500, ""),
        (400, "the server answered 400 Bad Request; the signature of the URL may have expired"),
        (401, "the server answered 401 Unauthorized; the signature of the URL may have expired"),
        (403, "the server answered 403 Forbidden; the signature of the URL may have expired"),
    ],
)
def test_only_a_refusal_of_what_may_be_there_is_a_problem(serve, status, said):
    assert web.web_problem(serve(status)) == said


def test_what_is_no_server_is_left_to_who_reads_it(serve):
    assert web.web_problem(serve("no web server")) == ""
