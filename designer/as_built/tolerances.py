"""Tolerances of a sensor's parts: three grades, or the engineer's own in a TOML file.

A tolerance is the largest magnitude of a departure. Grades are in the style of the classes of ISO 2768 and ISO 10110:
round numbers of what a general workshop, a good optical one and a precise one hold, and no manufacturer's
specification.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, field_validator

from designer.as_built.dual import Array
from designer.as_built.parameters import CAMERA, Parameter
from designer.configurations import MIRROR_NAMES
from designer.design import Design
from designer.files import InputError, describe_validation_error, read_toml

Grade = Literal["coarse", "standard", "precision"]
Tolerance = Annotated[float, Strict(), Field(ge=0.0, le=10.0, allow_inf_nan=False)]
Cost = Annotated[float, Strict(), Field(ge=0.0, le=1e6, allow_inf_nan=False)]
Percent = Annotated[float, Strict(), Field(gt=0.0, le=1000.0, allow_inf_nan=False)]


class Table(BaseModel):
    """Immutable, and strict about keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class MirrorTolerances(Table):
    """Tolerances of one mirror, or of all; None leaves a departure to the grade."""

    decentre_mm: Tolerance | None = None
    tilt_deg: Tolerance | None = None
    axial_shift_mm: Tolerance | None = None
    radius_percent: Tolerance | None = None
    conic: Tolerance | None = None
    plane_curvature_per_m: Tolerance | None = None


class CameraTolerances(Table):
    """Tolerances of the camera against the head that carries the mirrors, and of its lens."""

    shift_mm: Tolerance | None = None
    tilt_deg: Tolerance | None = None
    axial_shift_mm: Tolerance | None = None
    principal_distance_percent: Tolerance | None = None
    radial_distortion: Tolerance | None = None


class ClassCosts(Table):
    """What a tolerance costs in each class, in any unit: only their ratios matter."""

    coarse: Cost = 1.0
    standard: Cost = 2.0
    precision: Cost = 5.0


class Costs(ClassCosts):
    """The costs of every tolerance, and ``of`` some by their key, such as ``radius_percent``."""

    of: dict[str, ClassCosts] = {}


class Tolerances(Table):
    """What a tolerance file holds: a grade, tolerances of all mirrors, of one by its name, and of the camera.

    ``depth_error_growth_percent`` is the growth of the depth error at which a sensor is rejected; ``cost`` what the
    classes cost, for a budget.
    """

    grade: Grade = "standard"
    depth_error_growth_percent: Percent = 10.0
    mirrors: MirrorTolerances = MirrorTolerances()
    mirror: dict[str, MirrorTolerances] = {}
    camera: CameraTolerances = CameraTolerances()
    cost: Costs = Costs()

    @field_validator("cost")
    @classmethod
    def _costs_of_known_tolerances(cls, cost: Costs) -> Costs:
        known = {*MirrorTolerances.model_fields, *CameraTolerances.model_fields}
        for key in cost.of:
            if key not in known:
                raise ValueError(f"of.{key}: must be one of {', '.join(sorted(known))}")
        return cost


GRADES: dict[Grade, tuple[MirrorTolerances, CameraTolerances]] = {
    "coarse": (
        MirrorTolerances(
            decentre_mm=0.1,
            tilt_deg=0.1,
            axial_shift_mm=0.1,
            radius_percent=0.5,
            conic=0.01,
            plane_curvature_per_m=0.005,
        ),
        CameraTolerances(
            shift_mm=0.1, tilt_deg=0.1, axial_shift_mm=0.1, principal_distance_percent=1.0, radial_distortion=0.01
        ),
    ),
    "standard": (
        MirrorTolerances(
            decentre_mm=0.05,
            tilt_deg=0.05,
            axial_shift_mm=0.05,
            radius_percent=0.2,
            conic=0.003,
            plane_curvature_per_m=0.002,
        ),
        CameraTolerances(
            shift_mm=0.05, tilt_deg=0.05, axial_shift_mm=0.05, principal_distance_percent=0.5, radial_distortion=0.003
        ),
    ),
    "precision": (
        MirrorTolerances(
            decentre_mm=0.01,
            tilt_deg=0.01,
            axial_shift_mm=0.01,
            radius_percent=0.05,
            conic=0.001,
            plane_curvature_per_m=0.0005,
        ),
        CameraTolerances(
            shift_mm=0.01, tilt_deg=0.01, axial_shift_mm=0.01, principal_distance_percent=0.1, radial_distortion=0.001
        ),
    ),
}

# The key of a tolerance for each departure, and how it is counted: in its own unit or in percent of the nominal value.
_TOLERANCE_OF = {
    "decentre_x_mm": "decentre_mm",
    "decentre_y_mm": "decentre_mm",
    "shift_x_mm": "shift_mm",
    "shift_y_mm": "shift_mm",
    "tilt_x_deg": "tilt_deg",
    "tilt_y_deg": "tilt_deg",
    "axial_shift_mm": "axial_shift_mm",
    "radius_departure_mm": "radius_percent",
    "conic_departure": "conic",
    "curvature_per_m": "plane_curvature_per_m",
    "principal_distance_departure_mm": "principal_distance_percent",
    "radial_distortion": "radial_distortion",
}


def read_tolerances(path: Path, design: Design | None = None) -> Tolerances:
    """Read and validate a file of tolerances for a design, or for any.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, holds something that cannot be, names a mirror that the design does not
        have, or gives a plane a radius or another mirror the curvature of a plane: one line says what is allowed.
    """
    content = read_toml(path)
    names = MIRROR_NAMES if design is None else tuple(mirror.name for mirror in design.mirrors)
    try:
        tolerances = Tolerances.model_validate(content)
        for name, table in tolerances.mirror.items():
            if name not in names:
                raise InputError(f"{path}: mirror.{name}: must be a mirror of the design: {', '.join(names)}")
            if design is None:
                continue
            is_plane = design.mirror(name).radius_mm is None
            for key in ("radius_percent", "conic") if is_plane else ("plane_curvature_per_m",):
                if getattr(table, key) is not None:
                    kind = "a plane, use plane_curvature_per_m" if is_plane else "no plane, use radius_percent"
                    raise InputError(f"{path}: mirror.{name}.{key} = {getattr(table, key):g}: {name} is {kind}")
        return tolerances
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def tolerances_to_toml(tolerances: Tolerances) -> str:
    """The tolerances as a file that :func:`read_tolerances` understands."""
    return tomli_w.dumps(tolerances.model_dump(exclude_none=True))


def finer_grade(grade: Grade) -> Grade | None:
    """The next finer grade; None if there is none."""
    grades = list(GRADES)
    place = grades.index(grade) + 1
    return grades[place] if place < len(grades) else None


def tolerances_of_grade(grade: str) -> Tolerances:
    """The tolerances of a grade.

    Raises
    ------
    InputError
        There is no such grade.
    """
    if grade not in get_args(Grade):
        raise InputError(f"grade = {grade!r}: must be {', '.join(get_args(Grade))}")
    return Tolerances.model_validate({"grade": grade})


def tolerance_values(design: Design, parameters: tuple[Parameter, ...], tolerances: Tolerances) -> Array:
    """The tolerance (parameters,) of each departure of a design, in its own unit."""
    return np.array([_tolerance(design, parameter, tolerances) for parameter in parameters])


def growth_of(tolerances: Tolerances) -> float:
    """The share by which the depth error of a good sensor may grow."""
    return tolerances.depth_error_growth_percent / 100.0


def key_of(parameter: Parameter) -> str:
    """The key of a tolerance file that bounds a departure."""
    return _TOLERANCE_OF[parameter.key]


def is_open(tolerances: Tolerances, part: str, key: str) -> bool:
    """Whether a file leaves a tolerance of a part to the grade."""
    return all(getattr(table, key) is None for table in _given(tolerances, part))


def tolerance_of_grade(grade: Grade, part: str, key: str) -> float:
    """A tolerance of a grade, in the unit of its key."""
    of_mirrors, of_camera = GRADES[grade]
    return float(getattr(of_camera if part == CAMERA else of_mirrors, key))


def _given(tolerances: Tolerances, part: str) -> tuple[Table, ...]:
    if part == CAMERA:
        return (tolerances.camera,)
    return (tolerances.mirror.get(part, MirrorTolerances()), tolerances.mirrors)


def tolerance_of_part(tolerances: Tolerances, part: str, key: str) -> float:
    """A tolerance of a mirror or of the camera, in the unit of its key: the file's, else the grade's."""
    given = (value for table in _given(tolerances, part) if (value := getattr(table, key)) is not None)
    return float(next(given, tolerance_of_grade(tolerances.grade, part, key)))


def _tolerance(design: Design, parameter: Parameter, tolerances: Tolerances) -> float:
    part, key = parameter.part, key_of(parameter)
    value = tolerance_of_part(tolerances, part, key)
    nominal = design.camera.focal_length_mm if part == CAMERA else design.mirror(part).radius_mm
    return value / 100.0 * abs(nominal or 0.0) if key.endswith("_percent") else value
