"""From images to a calibrated sensor: detection, first guesses, bundle adjustment, better corners, once more."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.as_built.built import refuse_unbuildable
from designer.as_built.dual import Array
from designer.as_built.parameters import as_built_record
from designer.as_built.tolerances import Tolerances
from designer.calibration.bundle import Adjusted, Sighting, adjust
from designer.calibration.corners import refine_corners
from designer.calibration.detection import FEWEST_CORNERS, Detected, detect
from designer.calibration.first_guess import first_pose
from designer.calibration.target import Board, Target, board_of
from designer.calibration.target_pose import TargetPose
from designer.calibration.unknowns import Unknowns, unknowns_of
from designer.departures import CameraDeparture
from designer.design import VIEW_NAMES, Design, ViewName
from designer.files import InputError
from designer.imaging.images import Image

FEWEST_POSES = 3
# A first guess this far off is of another board, or of another design.
FARTHEST_PX = 60.0
Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedSensor:
    """A sensor as it was found.

    ``design`` has the ``as_built`` table; ``unknowns`` and ``adjusted`` hold priors, covariance and residuals;
    ``sightings`` the corners used, ``images`` the place among the given ones of the image of each target.
    """

    design: Design
    unknowns: Unknowns
    adjusted: Adjusted
    sightings: tuple[Sighting, ...]
    images: tuple[int, ...]

    @property
    def sigma(self) -> Array:
        """Standard deviations (parameters,) of the departures."""
        return np.asarray(np.sqrt(np.diagonal(self.adjusted.covariance)))


def calibrate(
    design: Design,
    images: Sequence[Image],
    target: Target,
    tolerances: Tolerances,
    free: Sequence[str] = (),
    names: Sequence[str] = (),
    progress: Progress = lambda line: None,
) -> CalibratedSensor:
    """Find the departures of the sensor that took images of one target at different places.

    Parameters
    ----------
    images
        Grey raw images (height, width) of the design's camera, each of the target at another place.
    tolerances
        What is known of the parts: a departure's standard deviation is half its tolerance.
    free
        See :func:`designer.calibration.unknowns.unknowns_of`.
    names
        What images are called in errors.
    progress
        Called with a line for each image.

    Raises
    ------
    InputError
        No target is found, in too few images or in one view only, or the sensor that explains the images cannot be:
        its parts touch, or a view shows nothing. Or the design has a tube.
    """
    if design.tube is not None:
        raise InputError(
            "housing: a sensor behind the wall of a tube is not calibrated: take the images without the tube, and the "
            "table housing out of the design file"
        )
    names = names or [f"image {number + 1}" for number in range(len(images))]
    as_designed = design.model_copy(update={"as_built": None})
    unknowns = unknowns_of(as_designed, tolerances, free)
    board, nothing = board_of(target), np.zeros(len(unknowns.parameters))
    seen, poses, used = [], [], []
    for number, (image, name) in enumerate(zip(images, names, strict=True)):
        found = detect(as_designed, image, board)
        guess = first_pose(as_designed, board, found, nothing)
        counted = ", ".join(f"{view} view {len(detected.numbers)} corners" for view, detected in found.items())
        if guess is None or guess[1] > FARTHEST_PX:
            progress(f"{name}: {'no target found' if not found else f'{counted}, but they fit no pose: left out'}")
            continue
        progress(f"{name}: {counted}")
        seen.append(found)
        poses.append(guess[0])
        used.append(number)
    _check_enough(seen, names)
    sightings = _sightings(seen, board)
    adjusted = adjust(as_designed, unknowns, sightings, poses)
    better = [
        _refined(as_designed, images[number], target, board, found, pose, adjusted.values)
        for number, found, pose in zip(used, seen, adjusted.poses, strict=True)
    ]
    kept = [place for place, found in enumerate(better) if found]
    _check_enough([better[place] for place in kept], names)
    sightings = _sightings([better[place] for place in kept], board)
    adjusted = adjust(as_designed, unknowns, sightings, [adjusted.poses[place] for place in kept])
    built = built_design(as_designed, unknowns, adjusted)
    return CalibratedSensor(built, unknowns, adjusted, tuple(sightings), tuple(used[place] for place in kept))


def built_design(design: Design, unknowns: Unknowns, adjusted: Adjusted) -> Design:
    """The design with the departures found, validated as its file would be.

    Raises
    ------
    InputError
        No sensor can be built so: parts touch, or a view is blind.
    """
    values = adjusted.values
    record = as_built_record(design, values[:-2])
    camera = record.camera.model_dump()
    for parameter, value in zip(unknowns.parameters[-2:], values[-2:], strict=True):
        camera[parameter.key] = float(value)
    record = record.model_copy(update={"camera": CameraDeparture.model_validate(camera)})
    built = design.model_copy(update={"as_built": record})
    try:
        refuse_unbuildable(built)
    except InputError as error:
        raise InputError(f"{error}; check that target, images and design belong together") from None
    return built


def _refined(
    design: Design,
    image: Image,
    target: Target,
    board: Board,
    seen: Mapping[ViewName, Detected],
    pose: TargetPose,
    values: Array,
) -> dict[ViewName, Detected]:
    refined = {
        view: refine_corners(design, view, image, target, board, detected, pose, values)
        for view, detected in seen.items()
    }
    return {view: detected for view, detected in refined.items() if len(detected.numbers) >= FEWEST_CORNERS}


def _sightings(seen: Sequence[Mapping[ViewName, Detected]], board: Board) -> list[Sighting]:
    return [
        Sighting(target, view, board.corners_mm[detected.numbers], detected.pixels)
        for target, found in enumerate(seen)
        for view, detected in found.items()
    ]


def _check_enough(seen: Sequence[Mapping[ViewName, Detected]], names: Sequence[str]) -> None:
    images = "1 image" if len(names) == 1 else f"{len(names)} images"
    if not any(seen):
        raise InputError(
            f"no target found in {images} ({names[0]}{', ...' if len(names) > 1 else ''}): check --target, and that "
            "squares are at least 16 pixels wide in the image"
        )
    if len(seen) < FEWEST_POSES:
        raise InputError(
            f"the target is found in {len(seen)} of {images}: at least {FEWEST_POSES} different poses are needed, "
            "better 8 to 12 all round"
        )
    for view in VIEW_NAMES:
        if not any(view in found for found in seen):
            raise InputError(f"no image shows the target in the {view} view: put it where both views see it")
