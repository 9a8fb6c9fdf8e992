"""What the headers of image files say, read without decoding the image."""

from __future__ import annotations

import struct
import zlib

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
# Frame headers of JPEG are C0 to CF, but for three markers of another kind; markers without a length are not met here.
_JPEG_FRAMES = set(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_TIFF_WIDTH, _TIFF_HEIGHT, _TIFF_ORIENTATION = 256, 257, 274


def image_size(data: bytes) -> tuple[int, int] | None:
    """Width and height in pixels of a PNG, BMP, JPEG or TIFF; None of other files and where there is no header."""
    try:
        if data.startswith(_PNG_SIGNATURE):
            width, height = struct.unpack_from(">II", data, 16)
        elif data.startswith(b"BM"):
            width, height = (abs(side) for side in struct.unpack_from("<ii", data, 18))
        elif data.startswith(_JPEG_START):
            return _size_of_jpeg(data)
        else:
            tags = _tiff_tags(data)
            width, height = tags[_TIFF_WIDTH], tags[_TIFF_HEIGHT]
    except (struct.error, KeyError):
        return None
    return width, height


def notes_another_orientation_as_tiff(data: bytes) -> bool:
    """Whether a TIFF notes an orientation other than 1, which OpenCV's decoder follows even when told not to."""
    return _tiff_tags(data).get(_TIFF_ORIENTATION, 1) != 1


def is_image_truncated(data: bytes) -> bool:
    """Whether a PNG or JPEG lacks its end, or a PNG is damaged."""
    if data.startswith(_PNG_SIGNATURE):
        return not _has_whole_png_chunks(data)
    if data.startswith(_JPEG_START):
        # Some cameras append metadata, or zeros, to the end of the image.
        return _JPEG_END not in data[-65536:]
    return False


def _has_whole_png_chunks(data: bytes) -> bool:
    """Whether every chunk up to the last, IEND, is there and has the checksum that it carries."""
    position = len(_PNG_SIGNATURE)
    while position + 12 <= len(data):
        length = int.from_bytes(data[position : position + 4], "big")
        end = position + 12 + length
        if end > len(data):
            return False
        kind, checksum = data[position + 4 : position + 8], int.from_bytes(data[end - 4 : end], "big")
        if zlib.crc32(data[position + 4 : end - 4]) != checksum:
            return False
        if kind == b"IEND":
            return True
        position = end
    return False


def _size_of_jpeg(data: bytes) -> tuple[int, int] | None:
    position = 2
    while position + 9 <= len(data) and data[position] == 0xFF:
        marker, length = data[position + 1], int.from_bytes(data[position + 2 : position + 4], "big")
        if marker == 0xFF:  # padding
            position += 1
        elif marker in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, position + 5)
            return width, height
        else:
            position += 2 + length
    return None


def _tiff_tags(data: bytes) -> dict[int, int]:
    """The numbers in the first directory of a TIFF by tag; empty for other files, and for one cut short."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
    if order is None:
        return {}
    tags = {}
    try:
        (start,) = struct.unpack_from(f"{order}I", data, 4)
        (count,) = struct.unpack_from(f"{order}H", data, start)
        for place in range(start + 2, start + 2 + 12 * count, 12):
            tag, kind = struct.unpack_from(f"{order}HH", data, place)
            # Numbers of 16 bits stand at the beginning of their four bytes, in either order.
            (tags[tag],) = struct.unpack_from(f"{order}{'H' if kind == 3 else 'I'}", data, place + 8)
    except struct.error:
        return {}
    return tags
