"""A short run of the fuzzer's files; `make fuzz` runs it for longer, with limits on time and memory."""

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rollcli.files.formats import MAP_FORMATS
from tests.fuzz.cases import CASES
from tests.fuzz.child import read_all_ways
from tests.fuzz.corpus import READERS, corpus
from tests.fuzz.mutations import at_random, every_region, with_repairs
from tests.fuzz.texts import READ_BY, read_text, texts
from tests.slow import mostly_slow

FILES = {name: data for name, data in corpus().items() if name != "large.png"}


# of TIFF's many layouts and compressions one of each is enough for every change
OFTEN = {"predictor2.tif", "lzw.tif", "deflate-tiles.tif", "pages.tif"}
QUICK = [name for name in FILES if name in OFTEN or not name.endswith(".tif")]


@pytest.mark.parametrize("name", mostly_slow(FILES, *QUICK))
def test_a_file_broken_anywhere_is_read_or_refused_in_one_line(name):
    answers = [read_all_ways(each) for broken in every_region(FILES[name]) for each in with_repairs(broken)]

    assert answers.count("refused") > len(answers) / 10


def test_every_map_format_has_a_reader_to_fuzz_and_every_file_one_reader():
    of_each = [name for reader in READERS for name in corpus([reader])]

    # OpenCV may be built without EXR, and numbers in RGB are those of a PNG
    assert MAP_FORMATS.keys() - {"exr", "rgb"} <= READERS.keys()
    assert sorted(of_each) == sorted(corpus())


@settings(max_examples=300)
@given(st.sampled_from(sorted(FILES)), st.integers(0, 2**32))
def test_a_file_broken_at_random_is_read_or_refused_in_one_line(name, seed):
    for each in with_repairs(at_random(FILES[name], Random(seed))):
        assert read_all_ways(each) in ("read", "refused")


@given(st.binary(max_size=200), st.sampled_from([b"", *{data[:8] for data in FILES.values()}]))
def test_any_bytes_are_read_or_refused_in_one_line(data, start):
    assert read_all_ways(start + data) in ("read", "refused")


@pytest.mark.parametrize("case", CASES)
def test_what_was_found_before_stays_fixed(case):
    assert read_all_ways(CASES[case]) == "refused"


@pytest.mark.parametrize("reader", mostly_slow(READ_BY, "lists", "settings", "urls"))
def test_whole_texts_are_read_and_broken_ones_are_read_or_refused(reader):
    random = Random(1)
    for name, whole in texts([reader]).items():
        assert read_text(whole, name) == ("refused" if "unrectified" in name or reader == "urls" else "read")
        answers = [read_text(at_random(whole, random), name) for _ in range(10)]
        assert set(answers) <= {"read", "refused"}
