"""Files of web servers: what is asked again, and what is said of a server that does not give them."""

import contextlib
import socket
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from rollcli.errors import InputError
from rollcli.files.stores import web

DATA = b"a map" * 1000


class Handler(BaseHTTPRequestHandler):
    """Answers as its server's `answers` say, one after the other; the last one for ever."""

    def do_GET(self):
        answers = self.server.answers
        status = answers.pop(0) if len(answers) > 1 else answers[0]
        if status == "no web server":
            self.wfile.write(b"220 mail.example.org\r\n")
            return
        self.send_response(200 if status == "cut" else status)
        self.send_header("Content-Length", str(len(DATA)))
        self.end_headers()
        self.wfile.write(DATA[:100] if status == "cut" else DATA)

    def log_message(self, *_):
        pass


@pytest.fixture
def serve():
    """Starts a server that gives these answers; returns the URL of a file, which has a signature."""
    with contextlib.ExitStack() as stack:

        def start(*answers):
            server = stack.enter_context(HTTPServer(("127.0.0.1", 0), Handler))
            server.answers = list(answers)
            stack.callback(server.shutdown)
            threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
            return f"http://127.0.0.1:{server.server_port}/map.png?signature=secret"

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
