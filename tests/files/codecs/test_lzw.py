"""LZW data are unpacked exactly, or refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollcli.files.codecs.lzw import LzwError, decode_lzw
from tests.binary_files import lzw_encode


@given(st.binary(min_size=1, max_size=3000), st.integers(1, 40))
def test_what_is_packed_is_unpacked(data, times):
    assert decode_lzw(lzw_encode(data * times), len(data) * times) == data * times


@pytest.mark.parametrize("spread", [1, 3, 17, 256])
def test_data_longer_than_many_tables_are_unpacked(spread):
    data = np.random.default_rng(0).integers(0, spread, 100_000, dtype=np.uint8).tobytes()

    assert decode_lzw(lzw_encode(data), len(data)) == data


def test_only_as_much_as_asked_for_is_unpacked():
    assert decode_lzw(lzw_encode(bytes(100_000)), 10) == bytes(10)


def test_what_follows_the_end_is_left_out():
    assert decode_lzw(lzw_encode(b"abcde") + b"xyz", 10) == b"abcde"


def test_no_data_at_all_are_refused():
    with pytest.raises(LzwError, match="no data"):
        decode_lzw(b"", 1)


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
