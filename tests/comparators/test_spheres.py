"""Spheres: where their rays cross the axis, their caustic, and the astigmatism of their images."""

from __future__ import annotations

import numpy as np
import pytest

from designer.comparators.asked import Asked
from designer.comparators.coaxial import view_by
from designer.comparators.head import Face, sphere
from designer.comparators.zones import zone_of
from designer.trace.aiming import exit_lines
from designer.trace.pencils import chief_rays_at, images_about
from support.shipped_problems import requirement_as_shipped

REQUIREMENT = requirement_as_shipped("indoor_robot")
ASKED = Asked.of(REQUIREMENT, REQUIREMENT.camera.lenses[0])
CAMERA = ASKED.camera((12.0, 0.01, 5.6))
PSI = np.radians([2.0, 4.0, 6.0, 7.5])


def crossing_behind_a_sphere(psi: np.ndarray, centre: float, radius: float) -> np.ndarray:
    """Height at which reflected rays cross the axis: both rays pass the centre at the same distance.

    With the angle of incidence i, sin i = (centre / radius) sin psi, the reflected ray has the angle 2 i - psi to the
    axis, and so crosses it centre sin(psi) / sin(2 i - psi) from the centre.
    """
    incidence = np.arcsin(centre / radius * np.sin(psi))
    return centre - centre * np.sin(psi) / np.sin(2.0 * incidence - psi)


def test_rays_cross_the_axis_where_the_closed_form_says():
    face = sphere(0.12, 0.1, 90.0)
    centre = face.vertex + face.radius
    view = view_by(CAMERA, face)
    (start_r, start_z), (ahead_r, ahead_z) = exit_lines(view.instrument, view.path, PSI)
    traced = start_z - start_r * ahead_z / ahead_r
    assert traced == pytest.approx(crossing_behind_a_sphere(PSI, centre, face.radius), rel=1e-12)
    # The ray that the sphere is made for leaves at the slope and crosses at the viewpoint asked for.
    assert crossing_behind_a_sphere(np.array([0.12]), centre, face.radius)[0] == pytest.approx(90.0, rel=1e-12)


def test_the_caustic_of_a_far_sphere_is_a_nephroid():
    """Of parallel rays the reflections from a circle envelop a nephroid, its cusp half a radius from the centre.

    That is Huygens's result of 1678; M. Levi, SIAM News, "Further upon reflection: caustics in a ball".
    """
    far, radius = 1e7, 20.0
    view = view_by(CAMERA, Face(far - radius, radius, 0.0))
    angle = np.radians([10.0, 25.0, 40.0])  # of incidence, where parallel rays meet the circle
    psi = np.arctan2(radius * np.sin(angle), far - radius * np.cos(angle))
    step = 1e-4 * psi
    intercepts, slopes = [], []
    for turned in (psi - step, psi + step):
        (start_r, start_z), (ahead_r, ahead_z) = exit_lines(view.instrument, view.path, turned)
        slopes.append(ahead_z / ahead_r)
        intercepts.append(start_z - start_r * slopes[-1])
    # Where neighbouring rays meet: z = intercept + R slope for both.
    across = -(intercepts[1] - intercepts[0]) / (slopes[1] - slopes[0])
    below = far - (intercepts[0] + intercepts[1]) / 2.0 - across * (slopes[0] + slopes[1]) / 2.0
    nephroid = (
        radius / 4.0 * np.array([3.0 * np.sin(angle) - np.sin(3.0 * angle), 3.0 * np.cos(angle) - np.cos(3.0 * angle)])
    )
    assert np.stack([across, below]) == pytest.approx(nephroid, rel=1e-4)


def test_images_are_astigmatic_as_coddington_has_it():
    """1/s_t + 1/s = 2 / (R cos i) and 1/s_s + 1/s = 2 cos(i) / R of a sphere, convex towards the light."""
    face = sphere(0.12, 0.1, 90.0)
    centre = face.vertex + face.radius
    view = view_by(CAMERA, face)
    chief = chief_rays_at(view.instrument, view.path, PSI)
    distance = 1500.0
    images = images_about(view.instrument, view.path, chief, np.array([distance]))
    before, after = chief.first_leg, chief.distance_beyond(np.array([distance]))[:, 0]
    cosine = np.cos(np.arcsin(centre / face.radius * np.sin(PSI)))
    # The virtual image lies behind the mirror; its distance from the pinhole adds the first leg.
    for power, found in (
        (2.0 / (face.radius * cosine), images.tangential[:, 0]),
        (2.0 * cosine / face.radius, images.sagittal[:, 0]),
    ):
        assert found == pytest.approx(1.0 / (before + 1.0 / (power + 1.0 / after)), rel=1e-8)


def test_the_single_viewpoint_error_is_that_of_the_closed_form():
    face = sphere(0.12, 0.0, 90.0)
    view = view_by(CAMERA, face)
    zone = zone_of(view, ASKED.volume, 90.0)
    crossing = crossing_behind_a_sphere(zone.psi, face.vertex + face.radius, face.radius)
    cosine = np.cos(zone.elevations)
    centre = np.sum(cosine**2 * crossing) / np.sum(cosine**2)
    assert zone.single_viewpoint_error_mm == pytest.approx(2.0 * np.max(np.abs(crossing - centre) * cosine), rel=1e-9)
    assert zone.single_viewpoint_error_mm > 1.0


def test_rays_that_are_aimed_already_wait_for_the_others():
    """Near spheres some points of a volume take more steps than others: none is lost meanwhile, if any is found."""
    near = requirement_as_shipped("pipe_inspection")
    camera = Asked.of(near, near.camera.lenses[0]).camera((12.0, 0.0025, 5.6))
    generator = np.random.default_rng(0)
    grid = np.broadcast_arrays(np.geomspace(120.0, 250.0, 9), np.linspace(-0.14, 0.14, 17)[:, None])
    distances, slopes = (part.ravel() for part in grid)
    for _ in range(80):
        psi, viewpoint = generator.uniform(0.1, 0.2), generator.uniform(100.0, 300.0)
        view = view_by(camera, sphere(psi, 0.0, viewpoint))
        heights = viewpoint + generator.uniform(-60.0, 60.0) + slopes * distances
        found = view.sight(distances, heights).psi
        assert np.isfinite(found).all() or np.isnan(found).sum() > 20
