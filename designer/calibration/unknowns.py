"""What a calibration looks for: departures of mirrors and camera, each with what is known of it before.

Images of targets at unknown places say where the parts of a sensor stand against each other, and never where the
sensor as a whole stands. So the camera holds still: its shift and tilt are not looked for unless asked, and mirrors
may be as far off as the tolerances of mirror and camera together allow. A place of the image on the chip, which the
as-built table also has, is looked for beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.parameters import CAMERA, IMAGE_KEYS, Parameter, parameters_of
from designer.as_built.tolerances import Tolerances, tolerance_values
from designer.as_built.yields import CUT_OFF
from designer.design import Design
from designer.files import InputError

CAMERA_POSE_KEYS = ("shift_x_mm", "shift_y_mm", "axial_shift_mm", "tilt_x_deg", "tilt_y_deg")
# The chip of a camera sits within some tenths of a millimetre of the lens's axis.
IMAGE_SHIFT_SIGMA_MM = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """All departures of a sensor, image shift last, and what is known of them before: a Gaussian about zero.

    ``prior`` (parameters, parameters) is its covariance, ``free`` (parameters,) says which are looked for; the others
    stay zero and have no covariance.
    """

    parameters: tuple[Parameter, ...]
    prior: Array
    free: Array

    @property
    def prior_sigma(self) -> Array:
        """Standard deviations (parameters,) of the prior."""
        return np.asarray(np.sqrt(np.diagonal(self.prior)))


def unknowns_of(design: Design, tolerances: Tolerances, free: Sequence[str] = ()) -> Unknowns:
    """The unknowns of a sensor built within tolerances, each of a standard deviation of half its tolerance.

    Parameters
    ----------
    free
        What is looked for: parts (``camera``, a mirror's name), keys of the ``as_built`` table (``tilt_x_deg``), or
        both (``secondary.tilt_x_deg``). Everything but the camera's pose by default.

    Raises
    ------
    InputError
        There is no such part or key, or nothing that is free has a tolerance.
    """
    departures = parameters_of(design)
    parameters = (*departures, *(Parameter(CAMERA, key) for key in IMAGE_KEYS))
    sigma = np.append(
        tolerance_values(design, departures, tolerances) / CUT_OFF,
        np.full(len(IMAGE_KEYS), IMAGE_SHIFT_SIGMA_MM / design.camera.pixel_pitch_mm),
    )
    for name in free:
        if not any(_is_named(parameter, (name,)) for parameter in parameters):
            parts = ", ".join(dict.fromkeys(parameter.part for parameter in parameters))
            keys = ", ".join(dict.fromkeys(parameter.key for parameter in parameters))
            raise InputError(f"--free {name}: must be a part ({parts}), a key ({keys}), or PART.KEY")
    is_pose = np.array([p.part == CAMERA and p.key in CAMERA_POSE_KEYS for p in parameters])
    wanted = np.array([_is_named(p, free) for p in parameters]) if free else ~is_pose
    wanted &= sigma > 0.0
    if not wanted.any():
        raise InputError("nothing to calibrate: everything that is free has a tolerance of zero")
    prior = np.diag(sigma**2)
    if not (wanted & is_pose).any():
        moved = _with_the_camera(design, parameters)
        prior = moved @ prior @ moved.T
    return Unknowns(parameters, prior * np.outer(wanted, wanted), wanted)


def _is_named(parameter: Parameter, names: Sequence[str]) -> bool:
    return bool({parameter.part, parameter.key, f"{parameter.part}.{parameter.key}"} & set(names))


def _with_the_camera(design: Design, parameters: Sequence[Parameter]) -> Array:
    """How departures in the camera's frame follow from those in the design's, (parameters, parameters).

    To first order a camera that is shifted sees mirrors shifted the other way, and one that is tilted sees them tilted
    about its pinhole.
    """
    place = {(parameter.part, parameter.key): index for index, parameter in enumerate(parameters)}
    moved = np.eye(len(parameters))
    for mirror in design.mirrors:
        swing = np.radians(mirror.vertex_mm)
        for key, of_camera, share in (
            ("decentre_x_mm", "shift_x_mm", 1.0),
            ("decentre_y_mm", "shift_y_mm", 1.0),
            ("axial_shift_mm", "axial_shift_mm", 1.0),
            ("tilt_x_deg", "tilt_x_deg", 1.0),
            ("tilt_y_deg", "tilt_y_deg", 1.0),
            ("decentre_x_mm", "tilt_y_deg", swing),
            ("decentre_y_mm", "tilt_x_deg", -swing),
        ):
            moved[place[mirror.name, key], place[CAMERA, of_camera]] -= share
    return moved
