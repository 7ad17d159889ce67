"""LZW data are unpacked exactly, or refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.files.codecs.tiff import LzwError, decode_lzw
from tests.binary_files import lzw_encode


@given(st.binary(min_size=1, max_size=3000), st.integers(1, 40))
def test_what_is_packed_is_unpacked(data, times):
    assert decode_lzw(lzw_encode(data * times), len(data) * times) == data * times


@pytest.mark.parametrize("spread", [1, 3, 17, 256])
def test_data_longer_than_many_tables_are_unpacked(spread):
    data = np.random.default_rng(0).integers(0, spread, 100_000, dtype=np.uint8).tobytes()

    assert decode_lzw(lzw_encode(data), len(data)) == data


@given(st.binary(min_size=1, max_size=300))
def test_any_bytes_are_unpacked_or_refused(packed):
    try:
        plain = decode_lzw(packed, 100)
    except LzwError:
        return
    assert 0 < len(plain) <= 100


def test_a_code_before_its_time_is_refused():
    early = int("100000000" + "001100001" + "111111111" + "100000001", 2)  # clear, "a", 511, end

    with pytest.raises(LzwError, match="not in the table"):
        decode_lzw(early.to_bytes(5, "big"), 4)


def packed(*codes):
    """Codes one after the other, each with its bits; the last byte filled up with zeros."""
    bits = "".join(f"{code:0{width}b}" for code, width in codes)
    return int(bits.ljust(-(-len(bits) // 8) * 8, "0"), 2).to_bytes(-(-len(bits) // 8), "big")


CLEAR, END = (256, 9), (257, 9)
LETTERS = [(ord(letter), 9) for letter in "abcdefg"]


def test_a_code_may_name_the_string_that_it_completes():
    # of TIFF 6.0, section 13: 258 is used while the table still lacks it
    assert decode_lzw(packed(CLEAR, LETTERS[0], (258, 9), (259, 9), END), 100) == b"a" + b"aa" + b"aaa"
    with pytest.raises(LzwError, match="not in the table"):
        decode_lzw(packed(CLEAR, LETTERS[0], (259, 9), END), 100)
    with pytest.raises(LzwError, match="not in the table"):
        decode_lzw(packed(CLEAR, (258, 9), END), 100)


def literals(count):
    """Letters alone: the codes grow by a bit where the table does, one early, as TIFF 6.0 has it."""
    numbers = [(7 * place) % 251 for place in range(count)]
    widths = [
        9 if place < 254 else 10 if place < 766 else 11 if place < 1790 else 12 for place in range(count)
    ]
    return bytes(numbers), list(zip(numbers, widths, strict=True))


@pytest.mark.parametrize("count", [253, 254, 255, 765, 766, 767, 1789, 1790, 1791, 3837, 3838])
def test_codes_grow_where_the_table_does(count):
    plain, codes = literals(count)
    width = 9 if count < 254 else 10 if count < 766 else 11 if count < 1790 else 12
    assert decode_lzw(packed(CLEAR, *codes, (257, width)), count + 1) == plain


def test_a_table_that_overflows_is_refused():
    plain, codes = literals(5000)
    with pytest.raises(LzwError, match="table overflow"):
        decode_lzw(packed(CLEAR, *codes), len(plain))


def test_tables_that_hold_next_to_nothing_are_refused():
    assert decode_lzw(packed(*[CLEAR] * 60, *LETTERS[:1], END), 10) == b"a"
    with pytest.raises(LzwError, match="too many tables"):
        decode_lzw(packed(*[CLEAR, LETTERS[0]] * 1000, END), 10_000)
