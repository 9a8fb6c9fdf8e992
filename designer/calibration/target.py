"""The flat target: a chessboard with a marker in each white square (ChArUco), its file and its picture.

Every inner corner has a number of its own, so that part of a board is enough. The frame is OpenCV's: origin at the
upper left corner of the board, x right, y down, z into the board, mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from designer.as_built.dual import Array
from designer.files import InputError, describe_validation_error, read_toml, write_atomically

# A marker is 6 modules wide and a square 8, so that every edge lies on a grid of modules.
MODULES, MARKER_MODULES = 8, 6
DICTIONARIES = ((50, cv2.aruco.DICT_4X4_50), (100, cv2.aruco.DICT_4X4_100), (250, cv2.aruco.DICT_4X4_250))
MOST_MARKERS = DICTIONARIES[-1][0]

Count = Annotated[int, Strict(), Field(ge=3, le=40)]
Millimetres = Annotated[float, Strict(), Field(ge=1.0, le=1000.0, allow_inf_nan=False)]


class Target(BaseModel):
    """A board of ``columns`` x ``rows`` squares with a side of ``square_mm``, as it was measured on the print."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    columns: Count = 9
    rows: Count = 6
    square_mm: Millimetres = 30.0

    @property
    def markers(self) -> int:
        """How many white squares hold a marker."""
        return self.columns * self.rows // 2

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the board."""
        return self.columns * self.square_mm, self.rows * self.square_mm


@dataclass(frozen=True, slots=True, eq=False)
class Board:
    """OpenCV's board of a target, and its inner corners (n, 3) in mm by their numbers."""

    charuco: Any
    corners_mm: Array


def make_target(columns: int, rows: int, square_mm: float, where: Path | str = "target") -> Target:
    """A target, validated as its file would be.

    Raises
    ------
    InputError
        There can be no such board.
    """
    return _validated({"columns": columns, "rows": rows, "square_mm": square_mm}, where)


def read_target(path: Path) -> Target:
    """Read the file that :func:`write_target` writes.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML or holds something that cannot be: one line says what is allowed.
    """
    return _validated(read_toml(path), path)


def write_target(path: Path, target: Target) -> None:
    """Write a target's file; ``square_mm`` is to be corrected to what is measured on the print."""
    write_atomically(
        path,
        "# ChArUco target of designer target: inner corners of a chessboard with 4 x 4 markers.\n"
        f"columns = {target.columns}\nrows = {target.rows}\n"
        f"# Measure the print over many squares, and write the side of one here.\nsquare_mm = {target.square_mm!r}\n",
    )


def board_of(target: Target) -> Board:
    """The board as OpenCV has it."""
    dictionary = next(number for most, number in DICTIONARIES if target.markers <= most)
    marker_mm = target.square_mm * MARKER_MODULES / MODULES
    size = (target.columns, target.rows)
    charuco = cv2.aruco.CharucoBoard(size, target.square_mm, marker_mm, cv2.aruco.getPredefinedDictionary(dictionary))
    return Board(charuco, np.asarray(charuco.getChessboardCorners(), dtype=float))


def modules_of(target: Target) -> NDArray[np.uint8]:
    """The board by its modules, (8 rows, 8 columns): 1 white, 0 black, the first row uppermost."""
    size = (MODULES * target.columns, MODULES * target.rows)
    image = board_of(target).charuco.generateImage((4 * size[0], 4 * size[1]), marginSize=0, borderBits=1)
    return (np.asarray(image)[2::4, 2::4] > 127).astype(np.uint8)


def _validated(content: dict[str, Any], where: Path | str) -> Target:
    try:
        target = Target.model_validate(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(where, error)) from None
    if target.markers > MOST_MARKERS:
        raise InputError(
            f"{where}: columns = {target.columns}, rows = {target.rows}: {target.markers} markers; at most "
            f"{MOST_MARKERS} differ enough to be told apart"
        )
    return target
