"""Image files: raw images in; images and arrays out. Every file is written whole or not at all."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import Camera
from designer.files import InputError, read_bytes, write_atomically

Image = NDArray[np.uint8]
"""Grey (height, width), or colour (height, width, 3) in OpenCV's order: blue, green, red."""

LARGEST_BYTES = 500_000_000

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_TIFF_ORIENTATION = 274


def read_raw_image(path: Path, camera: Camera) -> Image:
    """Read a raw image of a design's camera: grey (height, width) or colour (height, width, 3), 8 bits, OpenCV order.

    Deeper images keep their upper 8 bits. Pixels stay where the chip has them, whatever orientation the file notes: a
    camera that looks straight up notes an arbitrary one.

    Raises
    ------
    InputError
        The file cannot be read, is truncated or damaged, is no image, or has another size than the camera.
    """
    data = read_bytes(path, LARGEST_BYTES, "raw image")
    # Decoders fill what is missing of a truncated image with grey, and say nothing.
    if _is_truncated(data):
        raise InputError(f"{path}: the image is truncated or damaged; copy it again")
    if _notes_another_orientation_as_tiff(data):
        raise InputError(f"{path}: this TIFF has a rotation flag; save it as the camera recorded it (orientation 1)")
    as_recorded = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    decoded = cv2.imdecode(np.frombuffer(data, np.uint8), as_recorded) if data else None
    if decoded is None:
        raise InputError(f"{path}: not a readable image (use PNG, JPEG, TIFF or BMP)")
    height, width = decoded.shape[:2]
    if (width, height) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{path}: {width} x {height} pixels, but the design's camera has {camera.width_px} x {camera.height_px}"
        )
    return np.asarray(decoded, dtype=np.uint8)


def write_image(path: Path, image: Image | NDArray[np.uint16]) -> None:
    """Write an image of 8 or 16 bits as PNG; colour in OpenCV's order.

    Raises
    ------
    InputError
        The file cannot be written there; so for the other writers here.
    """
    _, encoded = cv2.imencode(".png", image)
    write_file(path, encoded.tobytes())


def write_arrays(path: Path, arrays: Mapping[str, NDArray[np.generic]]) -> None:
    """Write named arrays as a compressed ``.npz`` file."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_file(path, buffer.getvalue())


def write_file(path: Path, content: bytes) -> None:
    """Write bytes whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written there.
    """
    try:
        write_atomically(path, content)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def _notes_another_orientation_as_tiff(data: bytes) -> bool:
    """Whether a TIFF notes an orientation other than 1, which OpenCV's decoder follows even when told not to."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
    if order is None:
        return False
    try:
        (start,) = struct.unpack_from(f"{order}I", data, 4)
        (count,) = struct.unpack_from(f"{order}H", data, start)
        entries = (struct.unpack_from(f"{order}HHIH", data, start + 2 + 12 * index) for index in range(count))
        return any(tag == _TIFF_ORIENTATION and value != 1 for tag, _, _, value in entries)
    except struct.error:  # cut short: the decoder says so
        return False


def _is_truncated(data: bytes) -> bool:
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
