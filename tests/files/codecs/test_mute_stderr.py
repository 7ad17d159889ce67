"""What C libraries print while they decode goes nowhere, once that is asked for."""

import subprocess
import sys

from rollcli.files.codecs.png import decoding

TALK = """
import contextlib, os, sys
from rollcli.files.codecs.png import decoding, silence_decoders
{before}
print("a", file=sys.stderr, flush=True)
with decoding(), contextlib.suppress(OSError):
    os.write(2, b"libpng error\\n")
print("b", file=sys.stderr, flush=True)
"""


def heard(before):
    done = subprocess.run(
        [sys.executable, "-c", TALK.format(before=before)], capture_output=True, text=True, check=True
    )
    return done.stderr


def test_nothing_is_touched_before_it_is_asked_for():
    assert heard("") == "a\nlibpng error\nb\n"


def test_only_what_is_printed_while_decoding_is_lost():
    assert heard("silence_decoders()") == "a\nb\n"


def test_a_closed_terminal_is_no_trouble():
    close = "silence_decoders(); kept = os.dup(1); os.close(2); sys.stderr = os.fdopen(kept, 'w')"

    assert heard(close) == ""


def test_what_goes_wrong_inside_comes_out():
    caught = None
    try:
        with decoding():
            raise ValueError("inside")
    except ValueError as error:
        caught = error
    assert str(caught) == "inside"
