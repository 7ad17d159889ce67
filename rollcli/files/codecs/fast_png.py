"""16-bit grey PNG by wuffs, in 0.6 of OpenCV's time, where the extra `fast` is installed."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


def decode_grey16(data: bytes, width: int, height: int) -> NDArray[Any] | None:
    """Decode a 16-bit grey PNG that is not interlaced.

    Returns
    -------
    ndarray of uint16, shape (H, W), or None
        None where wuffs is not installed or finds something wrong: then OpenCV's verdict counts.
    """
    if (make_decoder := _decoders()) is None:
        return None
    result = make_decoder().decode(data)  # one decoder in two threads crashes
    # what it has not reached is 0, and it says so here alone
    if result.error_message or (buffer := result.pixbuf).shape != (height, width, 2):
        return None
    pixels: NDArray[Any] = buffer.view("<u2")[..., 0]
    return np.ascontiguousarray(pixels, np.uint16)


@lru_cache(maxsize=1)
def _decoders() -> Callable[[], Any] | None:
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
