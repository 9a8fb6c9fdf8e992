"""Calibration: the target, its images, and the sensor as it was built."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from designer.extras import needs

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from designer.calibration.calibrate import CalibratedSensor
    from designer.calibration.target import Target
    from designer.design import Design


@needs("imaging")
def target(columns: int = 9, rows: int = 6, square_mm: float = 30.0) -> Target:
    """A chessboard of so many squares with a marker in each white one, as ``designer target`` writes it.

    Raises
    ------
    InputError
        There can be no such board.
    """
    from designer.calibration.target import make_target

    return make_target(columns, rows, square_mm)


@needs("imaging")
def calibrate(
    design: Design,
    images: Sequence[ArrayLike | str | Path],
    target: Target | str | Path,
    tolerances: str | Path = "coarse",
    *,
    free: Sequence[str] = (),
) -> CalibratedSensor:
    """The sensor that took images of a target at different places: its ``design`` has an ``as_built`` table.

    Parameters
    ----------
    images
        Raw images of the design's camera: pixels of 8 bits, (height, width) or (height, width, 3) in OpenCV's order, or
        paths of image files.
    target
        The target, or the file that ``designer target`` wrote.
    tolerances
        What is known of the parts: a grade (``coarse``, ``standard``, ``precision``), or a TOML file of tolerances.
    free
        What is looked for: parts, keys of the ``as_built`` table, or ``PART.KEY``; all mirrors, the lens and the shift
        of the image by default.

    Raises
    ------
    InputError
        An image or a file cannot be used, no target is found, in too few images or in one view only, or no sensor can
        be built as the images say.
    """
    from designer.api.images import image_of
    from designer.as_built.tolerances import Grade, read_tolerances, tolerances_of_grade
    from designer.calibration.calibrate import calibrate as find
    from designer.calibration.target import Target, read_target
    from designer.imaging.stereo.rig import in_grey

    board = target if isinstance(target, Target) else read_target(Path(target))
    is_grade = str(tolerances) in get_args(Grade)
    asked = tolerances_of_grade(str(tolerances)) if is_grade else read_tolerances(Path(tolerances), design)
    raws = [in_grey(image_of(image, design.camera)) for image in images]
    names = [str(image) if isinstance(image, str | Path) else f"image {n + 1}" for n, image in enumerate(images)]
    return find(design, raws, board, asked, free, names)
