"""Lines on standard error: one a message, whatever it holds, and never an error of their own."""

import os

import pytest

from rollcli.messages import printable, say
from tests.run_cli import environment, python


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("maps/frame1.png: is empty", "maps/frame1.png: is empty"),
        ("Straße ü 日本.png", "Straße ü 日本.png"),
        ("a\x1b[2J\x07b", r"a\x1b[2J\x07b"),
        ("a\nrollcli: all is well\r", r"a\nrollcli: all is well\r"),
        ("a\u202egnp.b", r"a\u202egnp.b"),
        ("not text \udcff", r"not text \udcff"),
    ],
)
def test_what_a_terminal_would_obey_or_hide_is_escaped(text, shown):
    assert printable(text) == shown


def test_a_message_is_one_line_with_the_programs_name_and_without_passwords(capsys):
    say("a\nb", "https://me:p@ss@host/x@y.png: is empty")
    assert capsys.readouterr().err == "rollcli: a\\nb\nrollcli: https://host/x@y.png: is empty\n"


LOST = """
import os, sys
from rollcli.messages import let_stderr_fail, say
let_stderr_fail()
for number in range(3):
    say(str(number))
print("done", sys.stderr.fileno(), sys.stderr.isatty())
"""


@pytest.mark.parametrize(
    "broken", [None, lambda: os.close(2), lambda: os.dup2(os.open(os.devnull, os.O_RDONLY), 2)]
)
def test_messages_that_cannot_be_written_raise_nothing_and_leave_the_status(broken):
    read, write = os.pipe()
    os.close(read)
    done = python(LOST, stderr=write, preexec_fn=broken)
    os.close(write)
    assert (done.returncode, done.stdout[:4]) == (0, "done")


def test_text_of_any_encoding_can_be_said():
    done = python(LOST.replace("str(number)", "'ü \\udcff 日'"), env=environment(PYTHONIOENCODING="ascii"))
    assert (done.returncode, done.stderr.count("\n")) == (0, 3)
    assert done.stderr.startswith("rollcli: \\xfc ")
