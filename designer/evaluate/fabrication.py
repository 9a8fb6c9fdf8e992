"""What a shop needs to know about each mirror, and how large the finished head is.

Lengths in mm, angles in degrees, mass in grams.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, Mirror
from designer.optics.conic import Surface
from designer.optics.conversions import (
    BakerNayarForm,
    EccentricityForm,
    FocalForm,
    SecondFocus,
    SemiAxesForm,
    Shape,
    VertexForm,
    baker_nayar_from_focal,
    eccentricity_from_vertex,
    focal_from_vertex,
    semi_axes_from_focal,
)
from designer.optics.overall_size import OverallSize, Ring, Substrate, overall_size

ALUMINIUM_G_PER_MM3 = 2.70e-3
_PROFILE_POINTS = 201


@dataclass(frozen=True, slots=True)
class MirrorShape:
    """One mirror's face and blank. Forms that do not exist for its kind are None.

    ``shape`` is as its light sees it. ``sag_mm`` is the height of the face from its inner to its outer rim,
    ``sag_from_vertex_mm`` the farthest it gets from the plane through its vertex. ``sphere_departure_mm`` is measured
    peak to valley, along the normal of the best-fit sphere. Slopes are angles between the face and the horizontal.
    """

    name: str
    shape: Shape
    diameter_mm: float
    sag_mm: float
    sag_from_vertex_mm: float
    best_sphere_radius_mm: float | None
    sphere_departure_mm: float
    slope_deg: tuple[float, float]
    mass_g: float
    focal: FocalForm | None
    baker_nayar: BakerNayarForm | None
    semi_axes: SemiAxesForm | None
    eccentricity: EccentricityForm | None


def mirror_shape(design: Design, name: str) -> MirrorShape:
    """Shape of one mirror of a design, by its name."""
    mirror = design.mirror(name)
    surface = surface_of(mirror)
    radii, heights = _profile(mirror)
    sphere = best_fit_sphere(mirror)
    departure = 0.0 if sphere is None else float(np.ptp(sphere.distance_mm(radii, heights)))
    focal = _focal_form(design, mirror)
    vertex = _vertex_form(mirror)
    has_eccentricity = vertex.kind != "plane" and vertex.conic_constant <= 0
    return MirrorShape(
        name=name,
        shape=vertex.shape,
        diameter_mm=2.0 * mirror.outer_radius_mm,
        sag_mm=float(np.ptp(heights)),
        sag_from_vertex_mm=float(np.max(np.abs(heights))),
        best_sphere_radius_mm=None if sphere is None else sphere.radius_mm,
        sphere_departure_mm=departure,
        slope_deg=(_slope_deg(surface, mirror.inner_radius_mm), _slope_deg(surface, mirror.outer_radius_mm)),
        mass_g=_blank_volume_mm3(mirror) * ALUMINIUM_G_PER_MM3,
        focal=focal,
        baker_nayar=baker_nayar_from_focal(focal) if focal else None,
        semi_axes=semi_axes_from_focal(focal) if focal else None,
        eccentricity=eccentricity_from_vertex(vertex, _side(focal)) if has_eccentricity else None,
    )


@dataclass(frozen=True, slots=True)
class BestFitSphere:
    """The sphere from which a face departs least.

    ``centre_mm`` is the height of its centre above the mirror's vertex, ``radius_mm`` its radius with the sign of the
    mirror's (positive when the centre lies above the face).
    """

    centre_mm: float
    radius_mm: float

    def distance_mm(self, radii_mm: NDArray[np.float64], heights_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance along the sphere's normal of points by radius and height above the vertex; positive outside it."""
        return np.asarray(np.hypot(radii_mm, heights_mm - self.centre_mm) - abs(self.radius_mm))


def best_fit_sphere(mirror: Mirror) -> BestFitSphere | None:
    """The least-squares sphere of a mirror's face, every area of the face alike; None for a plane."""
    if mirror.radius_mm is None:
        return None
    radii, heights = _profile(mirror)
    centre, radius = mirror.radius_mm, abs(mirror.radius_mm)
    # Gauss-Newton on the distance from the sphere.
    for _ in range(30):
        distance = np.hypot(radii, heights - centre)
        jacobian = np.stack([-(heights - centre) / distance, -np.ones_like(distance)], axis=1)
        step = np.linalg.lstsq(jacobian, radius - distance, rcond=None)[0]
        centre, radius = centre + float(step[0]), radius + float(step[1])
    return BestFitSphere(centre, math.copysign(radius, mirror.radius_mm))


def surface_of(mirror: Mirror) -> Surface:
    """A design's mirror by vertex, curvature and (1 + K) c^2."""
    curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
    return Surface(mirror.vertex_mm, curvature, (1.0 + mirror.conic) * curvature**2)


def size_of(design: Design) -> OverallSize:
    """Overall height and diameter of a design's head, with its housing."""
    substrates = [
        Substrate(surface_of(mirror), mirror.inner_radius_mm, mirror.outer_radius_mm, mirror.back_offset_mm)
        for mirror in design.mirrors
    ]
    housing = design.housing
    ring = None if housing is None else Ring(housing.low_mm, housing.high_mm, housing.outer_radius_mm)
    return overall_size(substrates, design.camera.lens_front_mm, ring)


def overall_height_mm(design: Design) -> float:
    """From the lower of lens front and lowest part of the head to its highest part."""
    return float(size_of(design).height)


def overall_diameter_mm(design: Design) -> float:
    """Diameter over all mirrors with their substrates, and the housing."""
    return float(size_of(design).diameter)


def _blank_volume_mm3(mirror: Mirror) -> float:
    """Volume of a face shifted along z: base area times thickness, whatever the profile."""
    return math.pi * (mirror.outer_radius_mm**2 - mirror.inner_radius_mm**2) * mirror.thickness_mm


def _slope_deg(surface: Surface, radius: float) -> float:
    # At an equator, which rounding can put a hair within the rim or beyond it, the face is upright.
    run = math.sqrt(max(1.0 - surface.conic_term * radius**2, 0.0))
    return math.degrees(math.atan2(abs(surface.curvature * radius), run))


def _profile(mirror: Mirror) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radii, evenly spaced in area, and heights above the vertex, each (n,)."""
    radii = np.sqrt(np.linspace(mirror.inner_radius_mm**2, mirror.outer_radius_mm**2, _PROFILE_POINTS))
    return radii, surface_of(mirror).height(radii) - mirror.vertex_mm


def _vertex_form(mirror: Mirror) -> VertexForm:
    if mirror.radius_mm is None:
        return VertexForm(math.inf, 0.0)
    return VertexForm(mirror.radius_mm if mirror.faces == "down" else -mirror.radius_mm, mirror.conic)


def _focal_form(design: Design, mirror: Mirror) -> FocalForm | None:
    """The focal form, its focus A on the camera's side of the light; None for a paraboloid or a sphere."""
    vertex = _vertex_form(mirror)
    direction = 1.0 if mirror.faces == "down" else -1.0
    starts = any(view.path[0] == mirror.name for view in (design.views.upper, design.views.lower))
    known_focus = 0.0 if starts else _viewpoint_behind(design, mirror)
    if known_focus is None or vertex.kind == "paraboloid":
        return None
    to_vertex = direction * (mirror.vertex_mm - known_focus)
    if vertex.kind == "plane":
        # The foci of a plane are mirror images: both lie as far from it.
        return FocalForm(to_vertex if starts else -to_vertex, 0.0) if to_vertex else None
    if vertex.conic_constant >= 0:
        return None

    def misfit(form: FocalForm) -> float:
        # From focus A to the vertex it is c (1 + q), from focus B it is -c (1 - q).
        expected = form.vertex_distance if starts else form.vertex_distance - 2.0 * form.half_focal_distance
        return abs(expected - to_vertex)

    return min((focal_from_vertex(vertex, "ahead"), focal_from_vertex(vertex, "behind")), key=misfit)


def _viewpoint_behind(design: Design, mirror: Mirror) -> float | None:
    """Height of the viewpoint of the view in whose path the mirror comes last, if there is one."""
    views = (design.views.upper, design.views.lower)
    return next((view.viewpoint_mm for view in views if view.path[-1] == mirror.name), None)


def _side(focal: FocalForm | None) -> SecondFocus:
    return focal.sheet.second_focus if focal else "ahead"
