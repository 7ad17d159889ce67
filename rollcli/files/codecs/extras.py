"""What the packages of the extras `fast` and `tiff` do, and what is done where they are not installed."""

import zlib
from collections.abc import Callable
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


@lru_cache(maxsize=1)
def png_decoders() -> Callable[[], Any] | None:
    """Return what makes decoders of PNG alone that verify checksums; None where wuffs is not installed."""
    try:
        from pywuffs import ImageDecoderQuirks, ImageDecoderType, PixelFormat
        from pywuffs.aux import ImageDecoder, ImageDecoderConfig
    except ImportError:
        return None

    def make() -> Any:
        config = ImageDecoderConfig()
        config.enabled_decoders = [ImageDecoderType.PNG]
        config.pixel_format = PixelFormat.Y_16LE
        config.quirks = {ImageDecoderQuirks.IGNORE_CHECKSUM: 0}
        return ImageDecoder(config)

    return make


def crc32(data: bytes | memoryview) -> int:
    """Return the checksum of PNG and gzip, by libdeflate in a twentieth of the time where it is installed."""
    codecs = imagecodecs()
    found: int = zlib.crc32(data) if codecs is None else codecs.deflate_crc32(data)
    return found
