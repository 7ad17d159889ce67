"""What imagecodecs, of the extras `fast` and `tiff`, does, and what is done where it is not installed."""

import zlib
from functools import lru_cache
from typing import Any


@lru_cache(maxsize=1)
def imagecodecs() -> Any:
    """Return the package, or None where it is not installed."""
    try:
        import imagecodecs as package
    except ImportError:
        return None
    return package


def crc32(data: bytes | memoryview) -> int:
    """Return the checksum of PNG and gzip, by libdeflate in a twentieth of the time where it is installed."""
    codecs = imagecodecs()
    found: int = zlib.crc32(data) if codecs is None else codecs.deflate_crc32(data)
    return found
