"""One sensor as it was built: what is left of its viewpoints, and what its departures do to depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.as_built.merits import viewpoint_of
from designer.as_built.model import depth_error, measure, perturbable
from designer.as_built.parameters import values_of
from designer.as_built.projection import Projection, project
from designer.design import VIEW_NAMES, Design, ViewName
from designer.files import InputError

# Traced rays of a design pass its viewpoints within less.
SINGLE_VIEWPOINT_MM = 1e-6


@dataclass(frozen=True, slots=True)
class BuiltView:
    """What is left of a viewpoint, over the working volume and all azimuths.

    ``viewpoint_mm`` (x, y, z) is the point that the rays pass nearest to, ``spread_mm`` their root mean square distance
    from it, ``caustic_mm`` the diameter of the smallest ball about it that all of them meet.
    """

    viewpoint_mm: tuple[float, float, float]
    spread_mm: float
    caustic_mm: float


@dataclass(frozen=True, slots=True)
class BuiltSensor:
    """A sensor of the departures that its design file gives, read by the design's own tables.

    ``epipolar_px`` are columns of a panorama of 1800 by which the two views of a point are apart, ``depth_bias`` the
    share by which depths are wrong, both root mean squares over the working volume and all azimuths; None where rays
    part, so that there is no depth. ``_calibrated`` is what is left once each view's image centre, scale and turn are
    found. ``depth_error`` is that of the design, of noise alone; ``depth_error_calibrated`` that of noise and bias.
    """

    views: dict[ViewName, BuiltView]
    epipolar_px: float
    epipolar_px_calibrated: float
    depth_bias: float | None
    depth_bias_calibrated: float | None
    depth_error: float
    depth_error_calibrated: float | None
    blur_px: float


def built_sensor(design: Design) -> BuiltSensor | None:
    """The sensor that a design file describes; None if the file has no ``as_built`` table.

    Raises
    ------
    InputError
        A view of the design, or of the sensor, does not show the whole working volume.
    """
    if design.as_built is None:
        return None
    model = perturbable(design)
    values = values_of(design)[None]
    views = {}
    for name in VIEW_NAMES:
        projection = project(design, name, model.grid.targets[name], values)
        if not np.isfinite(projection.pixels).all():
            raise InputError(f"as_built: the {name} view does not show all points of the working volume any more")
        views[name] = _view(projection)
    found = measure(model, values)
    before, after = found.before, found.after
    return BuiltSensor(
        views=views,
        epipolar_px=float(before.epipolar_px[0]),
        epipolar_px_calibrated=float(after.epipolar_px[0]),
        depth_bias=_finite(before.depth_bias[0]),
        depth_bias_calibrated=_finite(after.depth_bias[0]),
        depth_error=model.noise,
        depth_error_calibrated=_finite(depth_error(model, after.depth_bias)[0]),
        blur_px=float(before.blur_px[0]),
    )


def describe_built(sensor: BuiltSensor) -> list[str]:
    """Lines of what the departures do."""
    caustic = max(view.caustic_mm for view in sensor.views.values())
    lines = [
        "as built: no single viewpoint any more"
        if caustic > SINGLE_VIEWPOINT_MM
        else "as built: each view still has a single viewpoint"
    ]
    for name, view in sensor.views.items():
        x, y, z = view.viewpoint_mm
        lines.append(
            f"  {name} view: caustic {view.caustic_mm:.3g} mm across, rays pass ({x:.3f}, {y:.3f}, {z:.3f}) mm at "
            f"{view.spread_mm:.3g} mm rms"
        )
    before, after, error = (
        "no depth: rays part" if share is None else f"{100.0 * share:.3g} %"
        for share in (sensor.depth_bias, sensor.depth_bias_calibrated, sensor.depth_error_calibrated)
    )
    lines += [
        f"  read by the design's tables: epipolar error {sensor.epipolar_px:.3g} px rms, depth bias {before} rms",
        f"  with each view's centre, scale and turn calibrated: {sensor.epipolar_px_calibrated:.3g} px, {after};",
        f"  depth error with noise {error}, as designed {100.0 * sensor.depth_error:.3g} %; "
        f"blur {sensor.blur_px:.2g} px rms",
        "  everything else said here is of the design without its departures",
    ]
    return lines


def _view(projection: Projection) -> BuiltView:
    point, spread = viewpoint_of(projection)
    offset = point[:, :, None] - projection.start
    missed = offset - projection.ahead * np.sum(offset * projection.ahead, axis=0)
    x, y, z = (float(part) for part in point[:, 0])
    return BuiltView((x, y, z), float(spread[0]), 2.0 * float(np.sqrt(np.sum(missed**2, axis=0)).max()))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
