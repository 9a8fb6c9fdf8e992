"""Image files: raw images in; images and arrays out. Every file is written whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import Camera
from designer.files import InputError, read_bytes, write_atomically
from designer.imaging.image_headers import image_size, is_image_truncated, notes_another_orientation_as_tiff

Image = NDArray[np.uint8]
"""Grey (height, width), or colour (height, width, 3) in OpenCV's order: blue, green, red."""

LARGEST_BYTES = 500_000_000


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
    if is_image_truncated(data):
        raise InputError(f"{path}: the image is truncated or damaged; copy it again")
    if notes_another_orientation_as_tiff(data):
        raise InputError(f"{path}: this TIFF has a rotation flag; save it as the camera recorded it (orientation 1)")
    # Before decoding, which takes gigabytes for some sizes that a file may claim.
    _check_size(path, image_size(data), camera)
    as_recorded = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        decoded = cv2.imdecode(np.frombuffer(data, np.uint8), as_recorded) if data else None
    except cv2.error:  # more pixels than OpenCV allows
        decoded = None
    if decoded is None:
        raise InputError(f"{path}: not a readable image (use PNG, JPEG, TIFF or BMP)")
    height, width = decoded.shape[:2]
    _check_size(path, (width, height), camera)
    return np.asarray(decoded, dtype=np.uint8)


def write_image(path: Path, image: Image | NDArray[np.uint16]) -> None:
    """Write an image of 8 or 16 bits as PNG; colour in OpenCV's order.

    Raises
    ------
    InputError
        The file cannot be written there; so for the other writers here.
    """
    _, encoded = cv2.imencode(".png", image)
    write_atomically(path, encoded.tobytes())


def write_arrays(path: Path, arrays: Mapping[str, NDArray[np.generic]]) -> None:
    """Write named arrays as a compressed ``.npz`` file."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_atomically(path, buffer.getvalue())


def _check_size(path: Path, size: tuple[int, int] | None, camera: Camera) -> None:
    if size is not None and size != (camera.width_px, camera.height_px):
        raise InputError(
            f"{path}: {size[0]} x {size[1]} pixels, but the design's camera has {camera.width_px} x {camera.height_px}"
        )
