"""Image files: orientations and depths that cameras write, and what is refused."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from designer.files import InputError
from designer.imaging.images import read_raw_image, write_image
from support.imaging_designs import coarse_prototype


def exif(orientation: int) -> bytes:
    """The least EXIF that notes an orientation (tag 274): a big-endian TIFF directory of one entry."""
    return b"MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0)


@pytest.mark.parametrize("orientation", [3, 6])
def test_an_image_stays_as_the_chip_has_it_whatever_orientation_it_notes(tmp_path: Path, orientation: int) -> None:
    camera = coarse_prototype().camera
    picture = np.random.default_rng(2).integers(0, 255, (600, 800, 3)).astype(np.uint8)
    _, encoded = cv2.imencode(".jpg", picture)
    plain = encoded.tobytes()
    note = b"Exif\0\0" + exif(orientation)
    (tmp_path / "plain.jpg").write_bytes(plain)
    turned = plain[:2] + b"\xff\xe1" + struct.pack(">H", len(note) + 2) + note + plain[2:]
    (tmp_path / "turned.jpg").write_bytes(turned)
    # The bytes do ask for it: a reader that heeds them turns the image.
    heeded = cv2.imread(str(tmp_path / "turned.jpg"))
    assert heeded.shape != (600, 800, 3) or (heeded != cv2.imread(str(tmp_path / "plain.jpg"))).any()
    read = [read_raw_image(tmp_path / f"{name}.jpg", camera) for name in ("plain", "turned")]
    np.testing.assert_array_equal(*read)


def tiff(path: Path, pixels: np.ndarray, orientation: int) -> Path:
    """An uncompressed grey TIFF of one strip that notes an orientation."""
    height, width = pixels.shape
    tags = {256: width, 257: height, 258: 8, 259: 1, 262: 1, 273: 8 + 2 + 12 * 9 + 4, 274: orientation, 278: height}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in (tags | {279: pixels.size}).items())
    path.write_bytes(b"II*\0" + struct.pack("<IH", 8, 9) + entries + bytes(4) + pixels.tobytes())
    return path


PIXELS = np.random.default_rng(4).integers(0, 255, (600, 800)).astype(np.uint8)


def test_a_tiff_is_read_as_it_is(tmp_path: Path) -> None:
    path = tiff(tmp_path / "raw.tiff", PIXELS, orientation=1)
    np.testing.assert_array_equal(read_raw_image(path, coarse_prototype().camera), PIXELS)


@pytest.mark.parametrize("orientation", [2, 3, 6, 8])
def test_a_tiff_that_asks_to_be_rotated_is_refused(tmp_path: Path, orientation: int) -> None:
    path = tiff(tmp_path / "raw.tiff", PIXELS, orientation)
    with pytest.raises(InputError, match="has a rotation flag"):
        read_raw_image(path, coarse_prototype().camera)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_an_image_written_is_read_back(tmp_path: Path, kind: type) -> None:
    deep = np.random.default_rng(5).integers(0, np.iinfo(kind).max, (600, 800)).astype(kind)
    write_image(tmp_path / "raw.png", deep)
    # Deeper images keep their upper 8 bits.
    expected = (deep.astype(int) >> 8 * (deep.itemsize - 1)).astype(np.uint8)
    np.testing.assert_array_equal(read_raw_image(tmp_path / "raw.png", coarse_prototype().camera), expected)


def test_an_image_that_cannot_be_written_gets_a_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="cannot be written"):
        write_image(tmp_path / "file" / "raw.png", PIXELS)
