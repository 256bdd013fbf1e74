"""Pictures and masks of exports, read without a library of images."""

import struct
import zlib

import numpy as np


def picture(path):
    """Levels of a PNG, grey of 8 or 16 bits or red, green and blue of 8, whose rows are unfiltered or differences to the left (PNG, third
    edition, section 9)."""
    content = path.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, head = 8, b"", None
    while at < len(content):
        length, kind = struct.unpack(">I4s", content[at : at + 8])
        body = content[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack(">I", content[at + 8 + length : at + 12 + length])[0]
        head = struct.unpack(">IIBBBBB", body) if kind == b"IHDR" else head
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    width, height, depth, colour, *_, interlaced = head
    assert (colour, depth) in ((0, 8), (0, 16), (2, 8)) and not interlaced
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, -1)
    filters, rows = rows[:, 0], rows[:, 1:].reshape(height, width, 3 if colour else depth // 8)
    assert set(np.unique(filters)) <= {0, 1}
    rows = np.where(filters[:, None, None] == 1, np.cumsum(rows, axis=1, dtype=np.uint8), rows)
    if colour:
        return rows
    return rows[..., 0] if depth == 8 else rows[..., 0].astype(np.uint16) * 256 + rows[..., 1]


def inclusive_box(mask):
    """Left, top, and largest less smallest column and row of a mask; -1 where nothing is set."""
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        return [-1, -1, -1, -1]
    return [int(columns.min()), int(rows.min()), int(np.ptp(columns)), int(np.ptp(rows))]


def decode(rle):
    """The mask of COCO's run lengths."""
    height, width = rle["size"]
    flat, value = [], False
    for count in rle["counts"]:
        flat.append(np.full(count, value))
        value = not value
    return np.concatenate(flat).reshape(width, height).T
