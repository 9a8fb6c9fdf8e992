"""One view as a sequence of surfaces, for sequential ray tracers: sensor, lens, mirrors, and a wall in the scene.

Light is traced from the sensor to the scene; its path is the same both ways. So the stop, the lens's entrance pupil, is
the first surface, every field is a point of the image, and no ray has to be aimed through mirrors that are met far from
their vertices. The last surface is a vertical wall, which rays about the horizon meet where a plane across the axis
would not.

Frame: pinhole at the origin, optical axis +z, fields and wall in the plane of y and z. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import Camera, Design, Mirror, ViewName
from designer.export.housing_words import without_the_housing
from designer.files import InputError
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.bundles import pinhole_directions
from designer.trace.image_law import is_perspective
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential

FIELDS = 5
# Mirrors and an ideal lens are the same at every wavelength; programs want one, and green is what sensors see best.
WAVELENGTH_UM = 0.55


@dataclass(frozen=True, slots=True)
class SequentialView:
    """A view for a sequential ray tracer.

    Attributes
    ----------
    title
        The configuration and the view, on one line.
    principal_distance_mm
        From the sensor to the lens, which stands at the pinhole.
    lens_focal_length_mm
        Focal length of the ideal thin lens that images the sensor at the distance to which the design is focused.
    pupil_diameter_mm
        Diameter of the stop, at the lens.
    mirrors
        In the order in which light from the sensor meets them. Radii of curvature and vertices are those of the
        record: positive z points up, along the axis, before and after every reflection.
    viewpoint_mm
        Height of the effective viewpoint, where the light of the middle field crosses the axis; the wall's zero.
    wall_mm
        Distance of the wall from the axis, towards +y: the geometric mean of the working volume's distances.
    elevations_deg
        Elevations of the fields, evenly from the lowest to the highest that the view must see.
    sensor_heights_mm
        Place y on the sensor whose light leaves at each of those elevations towards +y.
    left_out
        Sentences on what this design has and the file has not.
    """

    title: str
    principal_distance_mm: float
    lens_focal_length_mm: float
    pupil_diameter_mm: float
    mirrors: tuple[Mirror, ...]
    viewpoint_mm: float
    wall_mm: float
    elevations_deg: tuple[float, ...]
    sensor_heights_mm: tuple[float, ...]
    left_out: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user of the file must know, in short lines."""
        elevations = ", ".join(f"{each:+.4f}" for each in self.elevations_deg)
        return (
            f"{self.title}. All lengths in mm.",
            "Light runs from the sensor (object) to a wall in the scene (image). Stop: entrance pupil, at the lens.",
            f"Fields: points of the sensor at elevations {elevations} deg.",
            f"Wall: {self.wall_mm:.6g} mm from the axis, its zero at the height of the effective viewpoint.",
            "Not in this file: substrates, lens barrel, camera body and the other view, all of which can block light.",
            *self.left_out,
        )


def sequential_views(design: Design) -> dict[ViewName, SequentialView]:
    """Both views of a design.

    Raises
    ------
    InputError
        The lens is not perspective, no ray of the image leaves a view's mirrors at an elevation that it must see, or a
        distance is none.
    """
    refuse_other_laws(design.camera, "an ideal (paraxial) lens images r = f tan(psi)")
    return {name: _sequential_view(design, name) for name in design.views.by_name}


def refuse_other_laws(camera: Camera, reason: str) -> None:
    """Raise InputError, with the reason, for a lens that a format with perspective cameras cannot hold."""
    if not is_perspective(camera):
        described = f"{camera.projection} projection" + (" with distortion" if any(camera.distortion) else "")
        raise InputError(f"camera.projection: this format cannot hold a lens of {described}: {reason}")


def _sequential_view(design: Design, name: ViewName) -> SequentialView:
    view, camera = design.views.by_name[name], design.camera
    near, far = design.working_volume.distance_mm
    if not 0.0 < near <= far:
        raise InputError(f"working_volume.distance_mm: must be above 0 and increasing, not {near:g} to {far:g}")
    elevations = np.linspace(*view.elevation_deg, FIELDS)
    instrument = build_instrument(design)
    path = instrument.path(view.path)
    psi = pinhole_angles(instrument, path, np.radians(elevations), widest_pinhole_angle(design))
    with np.errstate(all="ignore"):
        trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
        outwards = trace.direction[:, 0]
        viewpoints = trace.point[:, 2] - trace.point[:, 0] * trace.direction[:, 2] / outwards
        heights = camera.focal_length_mm * np.tan(psi)
    leaves = np.isfinite(viewpoints) & np.isfinite(heights)
    if not leaves.all():
        raise InputError(
            f"views.{name}: no ray of the image leaves its mirrors at an elevation of "
            f"{elevations[~leaves][0]:g} degrees"
        )
    nearness = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    return SequentialView(
        title=f"{' '.join(design.configuration.split())}, {name} view",
        principal_distance_mm=camera.focal_length_mm,
        lens_focal_length_mm=1.0 / (1.0 / camera.focal_length_mm + nearness),
        pupil_diameter_mm=2.0 * camera.pupil_radius_mm,
        mirrors=tuple(design.mirror(each) for each in view.path),
        viewpoint_mm=float(viewpoints[FIELDS // 2]),
        wall_mm=float(np.sqrt(near) * np.sqrt(far)),
        elevations_deg=tuple(elevations.tolist()),
        # The image on the sensor is upside down.
        sensor_heights_mm=tuple((-np.sign(outwards) * heights).tolist()),
        left_out=without_the_housing(design),
    )
