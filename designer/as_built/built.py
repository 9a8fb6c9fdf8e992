"""One sensor as it was built: what is left of its viewpoints, and what its departures do to depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.as_built.merits import Grid, displacement_px, viewpoint_of
from designer.as_built.model import depth_error, measure, perturbable
from designer.as_built.parameters import values_of
from designer.as_built.projection import Projection, linearise, project, targets_of
from designer.departures import AsBuilt
from designer.design import VIEW_NAMES, Design, ViewName
from designer.files import InputError, finite
from designer.trace.built import build_as_built
from designer.trace.contact import built_contacts
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits

# Rays at the very ends of the range graze the rims of the design itself.
INSET_DEG = 0.01
# A view that shows less of the working volume is of no use.
LEAST_SEEN = 0.5


@dataclass(frozen=True, slots=True)
class BuiltView:
    """What is left of a viewpoint, over the working volume and all azimuths.

    ``viewpoint_mm`` (x, y, z) is the point that the rays pass nearest to, ``spread_mm`` their root mean square distance
    from it, ``caustic_mm`` the diameter of the smallest ball about it that all of them meet. ``rows_px`` and
    ``columns_px`` are how far the panorama that the design's tables make is off, root mean squares, of 1800 columns.
    ``seen`` is the share of the working volume, its edges included, whose light comes through unhindered. The others
    are None if the mirrors do not show all points of it.
    """

    viewpoint_mm: tuple[float, float, float] | None
    spread_mm: float | None
    caustic_mm: float | None
    rows_px: float | None
    columns_px: float | None
    seen: float


@dataclass(frozen=True, slots=True)
class BuiltSensor:
    """A sensor of the departures that its design file gives, read by the design's own tables.

    ``problems`` are the reasons to reject it: ``contacts``, sentences on solids that penetrate each other, and views
    that do not see all of the working volume. ``centres_apart_px`` is the distance between the image centres of the two
    views. ``epipolar_px`` are columns of a panorama of 1800 by which the two views of a point are apart, ``depth_bias``
    the share by which depths are wrong, both root mean squares over the working volume and all azimuths; None where the
    rays diverge, so that there is no depth. ``_calibrated`` is what is left once each view's image centre, scale and
    turn are found. ``depth_error`` is that of the design without departures: of noise, and of the scale's uncertainty
    if it has one; ``depth_error_calibrated`` that of the bias as well. ``is_nominal`` if all departures are zero. What
    takes both views is None if the mirrors of one do not show all points, however large.
    """

    views: dict[ViewName, BuiltView]
    problems: tuple[str, ...]
    contacts: tuple[str, ...]
    is_nominal: bool
    centres_apart_px: float | None
    epipolar_px: float | None
    epipolar_px_calibrated: float | None
    depth_bias: float | None
    depth_bias_calibrated: float | None
    depth_error: float
    depth_error_calibrated: float | None
    blur_px: float | None


def built_sensor(design: Design) -> BuiltSensor | None:
    """The sensor that a design file describes; None if the file has no ``as_built`` table.

    Raises
    ------
    InputError
        A view of the design itself does not show the whole working volume.
    """
    if design.as_built is None:
        return None
    model = perturbable(design)
    values = values_of(design)[None]
    views = {
        name: _view(
            design, model.grid, name, project(design, name, model.grid.targets[name], values, model.linear[name])
        )
        for name in VIEW_NAMES
    }
    camera = design.as_built.camera
    image_shift = camera.image_shift_x_px, camera.image_shift_y_px
    contacts = tuple(built_contacts(design))
    blind = tuple(
        f"the {name} view sees {100.0 * view.seen:.4g} % of the working volume"
        for name, view in views.items()
        if view.seen < 1.0
    )
    found = measure(model, values, image_shift_px=image_shift)
    before, after = found.before, found.after
    return BuiltSensor(
        views=views,
        problems=(*contacts, *blind),
        contacts=contacts,
        is_nominal=not values.any() and not any(image_shift),
        centres_apart_px=finite(found.centres_apart_px[0]),
        epipolar_px=finite(before.epipolar_px[0]),
        epipolar_px_calibrated=finite(after.epipolar_px[0]),
        depth_bias=finite(before.depth_bias[0]),
        depth_bias_calibrated=finite(after.depth_bias[0]),
        depth_error=model.noise,
        depth_error_calibrated=finite(depth_error(model, after.depth_bias)[0]),
        blur_px=finite(before.blur_px[0]),
    )


def refuse_unbuildable(design: Design) -> None:
    """Raise InputError if parts of the sensor of an ``as_built`` table touch, or a view shows little of its volume."""
    if contacts := built_contacts(design):
        raise InputError(f"as_built: {'; '.join(contacts)}: no sensor can be built so")
    for name in VIEW_NAMES:
        if (seen := _seen(design, name)) < LEAST_SEEN:
            raise InputError(
                f"as_built: the {name} view of this sensor sees {100.0 * seen:.3g} % of the working volume: the "
                "departures leave it blind"
            )


def _view(design: Design, grid: Grid, name: ViewName, projection: Projection) -> BuiltView:
    seen = _seen(design, name)
    if not np.isfinite(projection.pixels).all():
        return BuiltView(None, None, None, None, None, seen)
    camera = (design.as_built or AsBuilt()).camera
    shift = np.array([camera.image_shift_x_px, camera.image_shift_y_px])[:, None, None]
    rows, columns = displacement_px(design, grid, name, projection.pixels + shift)
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
        seen=seen,
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
    targets = targets_of(design, name, points)
    try:
        about_design = linearise(design, name, targets)
    except ValueError:  # the search is only longer
        about_design = None
    slopes = project(design, name, targets, values_of(design)[None], about_design).slopes[:, 0]
    shown = np.isfinite(slopes).all(axis=0)
    ahead = np.column_stack([*slopes[:, shown], np.ones(shown.sum())])
    instrument = build_as_built(design).instrument
    trace = trace_first_hits(instrument, ahead / np.linalg.norm(ahead, axis=1)[:, None])
    path = instrument.path(design.views.by_name[name].path)
    return float(np.sum(compare_with_path(trace, path).status == Status.OK) / len(points))
