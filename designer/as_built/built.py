"""One sensor as it was built: what is left of its viewpoints, and what its departures do to depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.as_built.merits import Grid, displacement_px, viewpoint_of
from designer.as_built.model import depth_error, measure, perturbable
from designer.as_built.parameters import values_of
from designer.as_built.projection import Projection, project, targets_of
from designer.design import VIEW_NAMES, Design, ViewName
from designer.files import InputError
from designer.trace.built import build_as_built
from designer.trace.contact import built_contacts
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits

# Traced rays of a design pass its viewpoints within less.
SINGLE_VIEWPOINT_MM = 1e-6
# Rays at the very ends of the range graze the rims of the design itself.
INSET_DEG = 0.01


@dataclass(frozen=True, slots=True)
class BuiltView:
    """What is left of a viewpoint, over the working volume and all azimuths.

    ``viewpoint_mm`` (x, y, z) is the point that the rays pass nearest to, ``spread_mm`` their root mean square distance
    from it, ``caustic_mm`` the diameter of the smallest ball about it that all of them meet. ``rows_px`` and
    ``columns_px`` are how far the panorama that the design's tables make is off, root mean squares, of 1800 columns.
    ``seen`` is the share of the working volume, its edges included, whose light comes through unhindered.
    """

    viewpoint_mm: tuple[float, float, float]
    spread_mm: float
    caustic_mm: float
    rows_px: float
    columns_px: float
    seen: float


@dataclass(frozen=True, slots=True)
class BuiltSensor:
    """A sensor of the departures that its design file gives, read by the design's own tables.

    ``contacts`` are sentences on solids that penetrate each other, ``centres_apart_px`` is the distance between the
    image centres of the two views. ``epipolar_px`` are columns of a panorama of 1800 by which the two views of a point
    are apart, ``depth_bias`` the share by which depths are wrong, both root mean squares over the working volume and
    all azimuths; None where rays part, so that there is no depth. ``_calibrated`` is what is left once each view's
    image centre, scale and turn are found. ``depth_error`` is that of the design, of noise alone;
    ``depth_error_calibrated`` that of noise and bias.
    """

    views: dict[ViewName, BuiltView]
    contacts: tuple[str, ...]
    centres_apart_px: float
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
        views[name] = _view(design, model.grid, name, projection)
    found = measure(model, values)
    before, after = found.before, found.after
    return BuiltSensor(
        views=views,
        contacts=tuple(built_contacts(design)),
        centres_apart_px=float(found.centres_apart_px[0]),
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
            f"{view.spread_mm:.3g} mm rms;"
        )
        lines.append(
            f"    its panorama is off by {view.rows_px:.3g} rows and {view.columns_px:.3g} columns rms; "
            f"it sees {100.0 * view.seen:.4g} % of the working volume"
        )
    before, after, error = (
        "no depth: rays part" if share is None else f"{100.0 * share:.3g} %"
        for share in (sensor.depth_bias, sensor.depth_bias_calibrated, sensor.depth_error_calibrated)
    )
    lines += [f"  {sentence}" for sentence in sensor.contacts]
    lines += [
        f"  read by the design's tables: epipolar error {sensor.epipolar_px:.3g} px rms, depth bias {before} rms; "
        f"image centres of the views {sensor.centres_apart_px:.3g} px apart",
        f"  with each view's centre, scale and turn calibrated: {sensor.epipolar_px_calibrated:.3g} px, {after};",
        f"  depth error with noise {error}, as designed {100.0 * sensor.depth_error:.3g} %; "
        f"blur {sensor.blur_px:.2g} px rms",
        "  everything else said here is of the design without its departures",
    ]
    return lines


def _view(design: Design, grid: Grid, name: ViewName, projection: Projection) -> BuiltView:
    rows, columns = displacement_px(design, grid, name, projection.pixels)
    point, spread = viewpoint_of(projection)
    offset = point[:, :, None] - projection.start
    missed = offset - projection.ahead * np.sum(offset * projection.ahead, axis=0)
    x, y, z = (float(part) for part in point[:, 0])
    return BuiltView(
        viewpoint_mm=(x, y, z),
        spread_mm=float(spread[0]),
        caustic_mm=2.0 * float(np.sqrt(np.sum(missed**2, axis=0)).max()),
        rows_px=float(np.sqrt(rows[0] ** 2 @ grid.weights)),
        columns_px=float(np.sqrt(columns[0] ** 2 @ grid.weights)),
        seen=_seen(design, name),
    )


def _seen(design: Design, name: ViewName) -> float:
    """The share of the working volume whose light meets the mirrors of a view, each first, and nothing else."""
    volume, middle = design.working_volume, design.views.middle_mm
    low, high = volume.elevation_deg
    elevation, distance, azimuth = (
        part.ravel()
        for part in np.meshgrid(
            np.radians(np.linspace(low + INSET_DEG, high - INSET_DEG, 17)),
            np.array(volume.distance_mm),
            np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False),
        )
    )
    points = np.stack(
        [distance * np.cos(azimuth), distance * np.sin(azimuth), middle + distance * np.tan(elevation)], axis=-1
    )
    slopes = project(design, name, targets_of(design, name, points), values_of(design)[None]).slopes[:, 0]
    shown = np.isfinite(slopes).all(axis=0)
    ahead = np.column_stack([*slopes[:, shown], np.ones(shown.sum())])
    instrument = build_as_built(design).instrument
    trace = trace_first_hits(instrument, ahead / np.linalg.norm(ahead, axis=1)[:, None])
    path = instrument.path(getattr(design.views, name).path)
    return float(np.sum(compare_with_path(trace, path).status == Status.OK) / len(points))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
