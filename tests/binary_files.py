"""Files for tests, written by hand: what our own writers cannot make, and what no writer should."""

import io
import struct
import zlib

import numpy as np
import tifffile

ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
COMPRESSIONS = {"none": 1, "lzw": 5, "deflate": 8, "old-deflate": 32946, "packbits": 32773}


def disparity_map(height=37, width=53, seed=0):
    """A sloping road with noise and holes, in pixels."""
    rng = np.random.default_rng(seed)
    values = np.add.outer(np.linspace(5, 90, height), np.linspace(-4, 4, width)) + rng.normal(
        0, 0.2, (height, width)
    )
    values[rng.random(values.shape) < 0.1] = 0
    return values


def flipped(data, bit):
    """The same bytes but for one bit."""
    broken = bytearray(data)
    broken[bit // 8] ^= 1 << bit % 8
    return bytes(broken)


# -- PNG


def png_chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png_file(*chunks):
    """A PNG file of (kind, body) chunks, with right checksums whatever is in them."""
    return b"\x89PNG\r\n\x1a\n" + b"".join(png_chunk(kind, body) for kind, body in chunks)


def png_header(width, height, depth=16, colour=0, interlace=0):
    return b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)


def png_rows(pixels, depth):
    """Unfiltered rows of (H, W) or (H, W, channels) numbers of `depth` bits, each after its filter byte."""
    rows = []
    for row in pixels.reshape(len(pixels), -1):
        if depth == 16:
            packed = row.astype(">u2").tobytes()
        else:
            bits = (row[:, None].astype(np.uint8) >> np.arange(depth - 1, -1, -1)) & 1
            packed = np.packbits(bits.reshape(-1)).tobytes()
        rows.append(b"\0" + packed)
    return b"".join(rows)


def make_png(pixels, depth=16, colour=0, interlace=False, palette=None, extra=()):
    """A PNG file; `extra` chunks go between header and data."""
    parts = [pixels[y::dy, x::dx] for x, y, dx, dy in ADAM7] if interlace else [pixels]
    raw = b"".join(png_rows(part, depth) for part in parts if part.size)
    chunks = [png_header(pixels.shape[1], pixels.shape[0], depth, colour, int(interlace)), *extra]
    if palette is not None:
        chunks.append((b"PLTE", palette))
    return png_file(*chunks, (b"IDAT", zlib.compress(raw)), (b"IEND", b""))


# -- TIFF


def lzw_encode(data):
    """LZW as TIFF has it: most significant bit first, codes of 9 to 12 bits."""
    bits, table, following = [], {bytes([i]): i for i in range(256)}, 258

    def emit(code):
        width = 9 + (following > 511) + (following > 1023) + (following > 2047)
        bits.append(format(code, f"0{width}b"))

    emit(256)
    current = b""
    for value in data:
        longer = current + bytes([value])
        if longer in table:
            current = longer
            continue
        emit(table[current])
        table[longer] = following
        following += 1
        if following == 4095:
            emit(256)
            table, following = {bytes([i]): i for i in range(256)}, 258
        current = bytes([value])
    if current:
        emit(table[current])
        following += 1
    emit(257)
    text = "".join(bits)
    text += "0" * (-len(text) % 8)
    return int(text, 2).to_bytes(len(text) // 8, "big")


def packbits_encode(data):
    """PackBits: repeats of three and more as runs, the rest as copies."""
    packed, position = bytearray(), 0
    while position < len(data):
        run = 1
        while run < 128 and data[position + run : position + run + 1] == data[position : position + 1]:
            run += 1
        if run > 2:
            packed += bytes([257 - run, data[position]])
            position += run
        else:
            copy = data[position : position + 5]
            packed += bytes([len(copy) - 1]) + copy
            position += len(copy)
    return bytes(packed)


def _predicted(block, predictor, order):
    """The bytes of a (rows, columns, channels) block after the predictor, in byte order `order`."""
    size = block.dtype.itemsize
    if predictor == 2:
        bits = np.ascontiguousarray(block).view(f"u{size}")
        bits = np.concatenate([bits[:, :1], np.diff(bits, axis=1)], axis=1)
        return bits.astype(f"{order}u{size}").tobytes()
    if predictor == 3:
        rows, columns, channels = block.shape
        sorted_bytes = block.astype(f">f{size}").view(np.uint8).reshape(rows, columns * channels, size)
        planes = sorted_bytes.transpose(0, 2, 1).reshape(rows, -1, channels)
        return np.concatenate([planes[:, :1], np.diff(planes, axis=1)], axis=1).tobytes()
    return block.astype(block.dtype.newbyteorder(order)).tobytes()


def make_tiff(
    pixels,
    compression="none",
    order="<",
    predictor=1,
    tile=None,
    rows_per_strip=None,
    big=False,
    photometric=1,
    nodata=None,
    pages=1,
    page_kind=0,
    sparse=(),
):
    """A TIFF file of (H, W) or (H, W, channels) numbers.

    tile is (rows, columns); page_kind the NewSubfileType of the second and later pages (1: a reduced copy);
    sparse the numbers of strips or tiles that are left out, as GDAL does.
    """
    image = pixels if pixels.ndim == 3 else pixels[..., None]
    height, width, channels = image.shape
    across = tile[1] if tile else width
    down = tile[0] if tile else (rows_per_strip or height)
    pack = {"lzw": lzw_encode, "packbits": packbits_encode, "none": bytes}.get(compression, zlib.compress)
    segments = []
    for top in range(0, height, down):
        for left in range(0, width, across):
            block = image[top : top + down, left : left + across]
            if tile:
                padding = ((0, down - block.shape[0]), (0, across - block.shape[1]), (0, 0))
                block = np.pad(block, padding)
            segments.append(pack(_predicted(block, predictor, order)))
    segments = [b"" if number in sparse else segment for number, segment in enumerate(segments)]
    tags = {
        256: ("I", [width]),
        257: ("I", [height]),
        258: ("H", [8 * image.dtype.itemsize] * channels),
        259: ("H", [COMPRESSIONS[compression]]),
        262: ("H", [photometric]),
        277: ("H", [channels]),
        317: ("H", [predictor]),
        339: ("H", [{"u": 1, "i": 2, "f": 3, "c": 6}[image.dtype.kind]] * channels),
    }
    if tile:
        tags |= {322: ("I", [across]), 323: ("I", [down])}
    else:
        tags[278] = ("I", [down])
    if nodata is not None:
        tags[42113] = ("s", nodata.encode() + b"\0")
    return _tiff_file(tags, segments, order, big, bool(tile), pages, page_kind)


def _tiff_file(tags, segments, order, big, tiled, pages, page_kind):
    file = io.BytesIO()
    mark = b"II" if order == "<" else b"MM"
    offset, count, entry_count = ("Q", "Q", "Q") if big else ("I", "I", "H")
    file.write(mark)
    file.write(struct.pack(order + "HHHQ", 43, 8, 0, 0) if big else struct.pack(order + "HI", 42, 0))
    link = file.tell() - struct.calcsize(order + offset)
    for page in range(pages):
        starts = []
        for segment in segments:
            starts.append(file.tell() if segment else 0)
            file.write(segment)
        own = dict(tags)
        own[254] = ("I", [page_kind if page else 0])
        own[324 if tiled else 273] = (offset, starts)
        own[325 if tiled else 279] = (offset, [len(segment) for segment in segments])
        entries = []
        for tag, (kind, values) in sorted(own.items()):
            body = values if kind == "s" else struct.pack(f"{order}{len(values)}{kind}", *values)
            code = {"s": 2, "H": 3, "I": 4, "Q": 16}[kind]
            if len(body) > struct.calcsize(offset):
                where = file.tell()
                file.write(body)
                body = struct.pack(order + offset, where)
            field = body.ljust(struct.calcsize(offset), b"\0")
            entries.append(struct.pack(order + "HH" + count, tag, code, len(values)) + field)
        where = file.tell()
        file.seek(link)
        file.write(struct.pack(order + offset, where))
        file.seek(where)
        file.write(struct.pack(order + entry_count, len(entries)) + b"".join(entries))
        link = file.tell()
        file.write(struct.pack(order + offset, 0))
    return file.getvalue()


_SHORTS = (258, 259, 262, 277, 317, 339)


def with_fields(tiff, changes):
    """The same little-endian TIFF with other numbers in some tags: {tag: (what stands there, the other)}."""
    for tag, numbers in changes.items():
        kind, fill = (3, "H2x") if tag in _SHORTS else (4, "I")
        was, new = (struct.pack(f"<HHI{fill}", tag, kind, 1, number) for number in numbers)
        assert was in tiff
        tiff = tiff.replace(was, new)
    return tiff


def tiff_of_bits(packed, compression, bits=1, **layout):
    """A TIFF of numbers of less than a byte, from the bytes that hold them, shape (H, W * bits / 8)."""
    width = packed.shape[1]
    whole = make_tiff(packed, compression, **layout)
    return with_fields(whole, {256: (width, width * 8 // bits), 258: (8, bits)})


def tiff_by_tifffile(values, **options):
    return _written(tifffile.imwrite, values, metadata=None, **options)


# -- NPY, NPZ and PFM


def _written(write, *values, **options):
    file = io.BytesIO()
    write(file, *values, **options)
    return file.getvalue()


def make_npy(values, **options):
    return _written(np.lib.format.write_array, values, **options)


def make_npz(save=np.savez_compressed, **arrays):
    return _written(save, **arrays)


def npy_header(text, version=1):
    """An NPY file with the header `text` and no data."""
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + length + text.encode("latin-1")


def make_pfm(values, header="Pf\n{width} {height}\n{scale}\n", scale="-1.0"):
    """A PFM file; the sign of `scale` is the byte order."""
    height, width = values.shape
    order = "<f4" if scale.startswith("-") else ">f4"
    text = header.format(width=width, height=height, scale=scale)
    return text.encode() + values[::-1].astype(order).tobytes()
