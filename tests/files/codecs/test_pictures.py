"""JPEG images that are cut, damaged or too large are refused without a word; whole ones are read."""

import struct

import cv2
import numpy as np
import pytest

from rollcli.errors import InputError
from rollcli.files.codecs.png import decoding
from rollcli.files.formats import decode_image
from tests.run_cli import python

IMAGE = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (120, 160), dtype=np.uint8), (0, 0), 2)
WHOLE = cv2.imencode(".jpg", IMAGE)[1].tobytes()
END = b"\xff\xd9"
# a process that works on frames, where what libraries print is heard; it reads images, and then maps
WORKER = """
import sys
from rollcli.errors import InputError
from rollcli.files.codecs.png import silence_decoders
from rollcli.files.formats import read_image, read_stored
silence_decoders()
for read, path in ((read, path) for read in (read_image, read_stored) for path in sys.argv[1:]):
    try:
        print(getattr(read(path), "shape", "map"))
    except InputError as error:
        print(error)
"""


def in_a_worker(folder, data):
    """What a worker says of an image."""
    (folder / "x.jpg").write_bytes(data)
    done = python(WORKER, "x.jpg", cwd=folder, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()[0]


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_jpeg_that_was_cut_and_closed_is_refused(tmp_path, share):
    start = WHOLE.index(b"\xff\xda") + 14
    cut = WHOLE[: start + int(share * (len(WHOLE) - start))] + END

    assert in_a_worker(tmp_path, cut) == "x.jpg: is a damaged JPEG: premature end of data segment"


def test_bytes_before_the_end_that_webcams_write_harm_nothing(tmp_path):
    assert in_a_worker(tmp_path, WHOLE[:-2] + bytes(3) + END) == "(120, 160)"


@pytest.mark.parametrize("progressive", [False, True])
def test_a_jpeg_that_claims_more_than_it_can_be_worth_is_refused_undecoded(progressive):
    options = [cv2.IMWRITE_JPEG_PROGRESSIVE, int(progressive)]
    whole = cv2.imencode(".jpg", np.dstack([IMAGE] * 3), options)[1].tobytes()
    place = whole.index(b"\xff\xc2" if progressive else b"\xff\xc0") + 5
    lying = whole[:place] + struct.pack(">HH", 65500, 65500) + whole[place + 4 :]

    with pytest.raises(InputError, match="claims 65500 x 65500 pixels"):
        decode_image(lying, "x.jpg")


def test_fill_bytes_before_a_marker_are_read_over():
    place = WHOLE.index(b"\xff\xc0")

    np.testing.assert_array_equal(
        decode_image(WHOLE[:place] + b"\xff\xff" + WHOLE[place:], "x.jpg"), decode_image(WHOLE, "x.jpg")
    )


@pytest.mark.parametrize("marker", sorted({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}), ids=hex)
def test_every_kind_of_frame_says_its_size_and_that_is_counted(marker):
    shortest = b"\xff\xd8\xff" + bytes([marker]) + struct.pack(">HBHHB", 11, 8, 65500, 65400, 1)
    with pytest.raises(InputError, match=r"x.jpg: its header claims 65400 x 65500 pixels"):
        decode_image(shortest, "x.jpg")
    with pytest.raises(InputError, match="no frame header"):
        decode_image(shortest[:-1], "x.jpg")


def test_a_scan_without_an_end_is_truncated():
    for data in (WHOLE[:-2], WHOLE + b"\xff\xda" + bytes(20)):
        with pytest.raises(InputError, match=r"^x.jpg: is a truncated JPEG$"):
            decode_image(data, "x.jpg")


TALK = """
import contextlib, os, sys
from rollcli.files.codecs.png import decoding, silence_decoders
{before}
print("a", file=sys.stderr, flush=True)
with decoding(), contextlib.suppress(OSError):
    os.write(2, b"libpng error\\n")
print("b", file=sys.stderr, flush=True)
"""


CLOSED = "silence_decoders(); kept = os.dup(1); os.close(2); sys.stderr = os.fdopen(kept, 'w')"
HEARD = {"": "a\nlibpng error\nb\n", "silence_decoders()": "a\nb\n", CLOSED: ""}


@pytest.mark.parametrize(("before", "heard"), HEARD.items(), ids=["not asked for", "asked for", "closed"])
def test_only_what_is_printed_while_decoding_is_lost_and_once_it_is_asked_for(before, heard):
    assert python(TALK.format(before=before), check=True).stderr == heard


def test_what_goes_wrong_inside_comes_out():
    with pytest.raises(ValueError, match=r"^inside$"), decoding():
        raise ValueError("inside")
