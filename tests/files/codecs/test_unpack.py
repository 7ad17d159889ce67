"""Packed strips and tiles against examples that others have published."""

import zlib

import pytest

from rollcli.files.codecs import tiff as unpack
from rollcli.files.codecs.tiff import unpacked

PACKBITS, DEFLATE, DEFLATE_OF_BEFORE = 32773, 8, 32946  # of libtiff's tiff.h
# of Apple's Technical Note TN1023
PACKED = bytes.fromhex("FE AA 02 80 00 2A FD AA 03 80 00 2A 22 F7 AA")
PLAIN = bytes.fromhex("AA AA AA 80 00 2A AA AA AA AA 80 00 2A 22") + 10 * b"\xaa"


@pytest.mark.parametrize("installed", [True, False], ids=["as installed", "in Python"])
@pytest.mark.parametrize("idle", [b"", b"\x80", b"\x80\x80\x80"], ids=len)
def test_packbits_are_those_of_its_maker_and_a_head_of_128_stands_for_nothing(monkeypatch, installed, idle):
    if not installed:
        monkeypatch.setattr(unpack, "imagecodecs", lambda: None)
    packed = idle + PACKED[:6] + idle + PACKED[6:] + idle
    assert unpacked(PACKBITS, packed, len(PLAIN), len(PLAIN)) == PLAIN


@pytest.mark.parametrize("installed", [True, False], ids=["as installed", "in Python"])
@pytest.mark.parametrize("compression", [DEFLATE, DEFLATE_OF_BEFORE])
def test_deflate_has_two_numbers(monkeypatch, installed, compression):
    if not installed:
        monkeypatch.setattr(unpack, "imagecodecs", lambda: None)
    assert unpacked(compression, zlib.compress(PLAIN), len(PLAIN), len(PLAIN)) == PLAIN
