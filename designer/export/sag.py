"""Sag tables: the face of each mirror as heights over radius, as a diamond-turning or measuring shop reads it.

Comma-separated values below a header of comment lines (``#``). Everything in mm and degrees.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, Mirror
from designer.evaluate.fabrication import BestFitSphere, best_fit_sphere
from designer.files import InputError
from designer.trace.instrument import sag

Floats = NDArray[np.float64]

# Half a picometre of rounding. Radii are written in full: near an equator the face is so steep that it matters.
DECIMALS = 9
# A sphere's distances are differences of numbers as large as its radius; beyond this they lose the last decimals.
_LARGEST_SPHERE_MM = 1e6
_MOST_STEPS = 1000
_EQUATION = "sag = c r^2 / (1 + sqrt(1 - (1 + K) c^2 r^2)), c = 1 / R"


def sag_tables(design: Design) -> dict[str, str]:
    """The sag table of each mirror of a design, by the mirror's name.

    Raises
    ------
    InputError
        A face is too large or too steep for a table.
    """
    return {mirror.name: _table(design, mirror) for mirror in design.mirrors}


def table_radii(mirror: Mirror) -> Floats:
    """Radii (n,) in mm of a table's rows: both rims, and between them whole multiples of a round step.

    The step is 1, 2 or 5 times a power of ten, the smallest that gives at most a thousand rows.
    """
    inner, outer = mirror.inner_radius_mm, mirror.outer_radius_mm
    least = (outer - inner) / _MOST_STEPS
    # One tenth of the power of ten below, so that rounding of the logarithm does no harm.
    power = math.floor(math.log10(least))
    exponent, factor = next((e, f) for e in (power - 1, power, power + 1) for f in (1, 2, 5) if f * 10.0**e >= least)
    first, last = math.floor(inner / (factor * 10.0**exponent)) + 1, math.ceil(outer / (factor * 10.0**exponent))
    steps = [float(f"{number * factor}e{exponent}") for number in range(first, last)]
    return np.array([inner, *(radius for radius in steps if inner < radius < outer), outer])


def slopes_deg(mirror: Mirror, radii_mm: Floats) -> Floats:
    """Angle (n,) of the face from the horizontal, positive where it rises with radius."""
    if mirror.radius_mm is None:
        return np.zeros_like(radii_mm)
    ratio = radii_mm / mirror.radius_mm
    # At an equator the face is upright, whichever side of it rounding falls on.
    run = np.sqrt(np.maximum(1.0 - (1.0 + mirror.conic) * ratio**2, 0.0))
    return np.asarray(np.degrees(np.arctan2(ratio, run)))


def _table(design: Design, mirror: Mirror) -> str:
    if not 1e-6 <= mirror.outer_radius_mm - mirror.inner_radius_mm <= mirror.outer_radius_mm <= 1e6:
        raise InputError(
            f"mirror {mirror.name}: a face from radius {mirror.inner_radius_mm:g} to {mirror.outer_radius_mm:g} mm "
            "cannot be tabled; its width must be at least 1e-06 mm and its radius at most 1e+06 mm"
        )
    radii = table_radii(mirror)
    with np.errstate(all="ignore"):
        heights, slopes = sag(mirror, radii), slopes_deg(mirror, radii)
    if not (np.isfinite(heights).all() and np.abs(heights).max() <= 1e6 and np.isfinite(slopes).all()):
        raise InputError(f"mirror {mirror.name}: its face is steeper than a table to {10.0**-DECIMALS:g} mm can hold")
    sphere = _sphere(mirror)
    columns = ["radius_mm", "sag_mm", "slope_deg"]
    values = [radii, heights, slopes]
    if sphere is not None:
        columns.append("from_best_fit_sphere_mm")
        values.append(sphere.distance_mm(radii, heights))
    rows = [
        ",".join([repr(float(radius)), *(f"{value + 0.0:.{DECIMALS}f}" for value in others)])
        for radius, *others in zip(*values, strict=True)
    ]
    return "\n".join([*(f"# {line}" for line in _header(design, mirror, sphere)), ",".join(columns), *rows]) + "\n"


def _sphere(mirror: Mirror) -> BestFitSphere | None:
    """The best-fit sphere, or None where a face is so flat or so odd that distances from it would say nothing."""
    if mirror.radius_mm is None or abs(mirror.radius_mm) > _LARGEST_SPHERE_MM:
        return None
    try:
        with np.errstate(all="ignore"):
            sphere = best_fit_sphere(mirror)
    except np.linalg.LinAlgError:
        return None
    return sphere if sphere is not None and abs(sphere.radius_mm) <= _LARGEST_SPHERE_MM else None


def _header(design: Design, mirror: Mirror, sphere: BestFitSphere | None) -> list[str]:
    radius = "infinite (plane)" if mirror.radius_mm is None else f"{mirror.radius_mm!r} mm"
    lines = [
        f"configuration: {' '.join(design.configuration.split())}",
        f"mirror: {' '.join(mirror.name.split())}, {mirror.kind}, reflecting side faces {mirror.faces}",
        "lengths in mm, angles in degrees; z points up, from the camera along the optical axis",
        f"conic constant K: {mirror.conic!r}",
        f"vertex radius R: {radius}; positive when the centre of curvature lies above the vertex",
        f"vertex height: {mirror.vertex_mm!r} mm above the pinhole, the centre of the lens's entrance pupil",
        f"face: from inner radius {mirror.inner_radius_mm!r} to outer radius {mirror.outer_radius_mm!r} mm",
        f"equation: {_EQUATION}, r the distance from the axis",
        "sag_mm: height above the vertex, positive upwards; slope_deg: positive where the face rises with radius",
    ]
    if sphere is None:
        lines.append(f"best-fit sphere: none (a plane, or a radius beyond {_LARGEST_SPHERE_MM:g} mm)")
    else:
        lines.append(
            f"best-fit sphere: radius {abs(sphere.radius_mm)!r} mm, centre {sphere.centre_mm!r} mm above the vertex; "
            "from_best_fit_sphere_mm: along its normal, positive outside it"
        )
    return lines
