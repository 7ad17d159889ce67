"""Ways to break a file; all of them repeatable."""

from collections.abc import Iterator
from random import Random

from tests.fuzz.corpus import repaired_png

_NUMBERS = (0, 1, 127, 128, 255, 2**15 - 1, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)
_SHORT = (*(bytes([each]) for each in b"\n\r #'\"\0\xff"), *b"-1 1e999 nan 999999999 \\ud800 ../".split())
_LONG = (b"(" * 50, b"0" * 300, b"9" * 5000, b"[" * 5000, b"{" * 5000)


def every_region(data: bytes) -> Iterator[bytes]:
    """Each of 100 regions of a file cut off, flipped, zeroed and left out, and its first bytes flipped."""
    step = max(1, len(data) // 100)
    for start in range(0, len(data), step):
        end = start + step
        yield data[:start]
        yield data[:start] + data[end:]
        yield data[:start] + bytes(byte ^ 0xFF for byte in data[start:end]) + data[end:]
        yield data[:start] + bytes(len(data[start:end])) + data[end:]
    for position in range(min(len(data), 200)):
        yield data[:position] + bytes([data[position] ^ 0x41]) + data[position + 1 :]


def at_random(data: bytes, random: Random) -> bytes:
    """A file broken in one to four places."""
    broken = bytearray(data)
    for _ in range(random.randint(1, 4)):
        random.choice(_MUTATIONS)(broken, random)
    return bytes(broken)


def with_repairs(data: bytes) -> Iterator[bytes]:
    """The file, and for a PNG once more with its checksums made right."""
    yield data
    if data.startswith(b"\x89PNG"):
        yield repaired_png(data)


def _place(data: bytearray, random: Random) -> int:
    """More often near the start, where the headers are."""
    if random.random() < 0.5:
        return random.randrange(min(len(data), 120) + 1)
    return random.randrange(len(data) + 1)


def _flip(data: bytearray, random: Random) -> None:
    place = _place(data, random)
    data[place : place + 1] = bytes([random.randrange(256)])


def _number(data: bytearray, random: Random) -> None:
    size = random.choice((1, 2, 4, 8))
    number = random.choice(_NUMBERS) % 2 ** (8 * size)
    place = _place(data, random)
    data[place : place + size] = number.to_bytes(size, random.choice(("little", "big")))


def _text(data: bytearray, random: Random) -> None:
    place, text = _place(data, random), random.choice(_SHORT + _LONG)
    data[place : place + random.choice((0, len(text)))] = text


def _cut(data: bytearray, random: Random) -> None:
    del data[_place(data, random) :]


def _leave_out(data: bytearray, random: Random) -> None:
    place = _place(data, random)
    del data[place : place + random.randint(1, 30)]


def _repeat(data: bytearray, random: Random) -> None:
    place = _place(data, random)
    data[place:place] = data[place : place + random.randint(1, 60)]


_MUTATIONS = (_flip, _flip, _flip, _number, _number, _text, _cut, _leave_out, _repeat)
