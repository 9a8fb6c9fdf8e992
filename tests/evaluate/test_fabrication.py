"""Mirror shapes against the implicit conic, known aberrations and published foci."""

from __future__ import annotations

import math

import numpy as np
import pytest

from designer.design import Design, Mirror
from designer.evaluate.fabrication import mirror_shape, overall_diameter_mm, overall_height_mm, surface_of


def with_mirror(design: Design, **changes: object) -> Design:
    """The same design, its direct mirror changed."""
    record = design.model_dump(mode="json", by_alias=True)
    record["mirrors"][0] |= changes
    return Design.model_validate(record)


def test_published_foci(published: Design):
    upper = mirror_shape(published, "direct")
    assert 2 * upper.focal.half_focal_distance == pytest.approx(123.488, abs=1e-4)
    primary = mirror_shape(published, "primary")
    assert 2 * primary.focal.half_focal_distance == pytest.approx(233.684 + 8.119, abs=2e-3)
    plane = mirror_shape(published, "secondary")
    assert plane.focal.half_focal_distance == 116.842
    assert plane.sag_mm == plane.sphere_departure_mm == 0
    gain = primary.focal.gain * plane.focal.gain
    assert gain == pytest.approx(published.views.lower.gain, rel=1e-12)


def test_profile_lies_on_equation_1(published: Design):
    """(Z - c)^2 - R^2 (k/2 - 1) = c^2 (k - 2) / k, with c and k from the vertex radius and the conic constant."""
    shape = mirror_shape(published, "direct")
    c, k = shape.baker_nayar.half_focal_distance, shape.baker_nayar.k
    radii = np.linspace(17.226, 37.0, 50)
    heights = surface_of(published.mirror("direct")).height(radii)
    residual = (heights - c) ** 2 - radii**2 * (k / 2 - 1) - c**2 * (k - 2) / k
    # The published vertex is rounded to 1e-4 mm.
    assert np.abs(residual).max() < 0.03
    assert shape.sag_mm == pytest.approx(np.ptp(heights), rel=1e-12)


def test_slopes_are_the_profile_s_derivative(published: Design):
    for mirror in published.mirrors:
        surface = surface_of(mirror)
        for radius, slope in zip(
            (mirror.inner_radius_mm, mirror.outer_radius_mm),
            mirror_shape(published, mirror.name).slope_deg,
            strict=True,
        ):
            rise = (surface.height(radius + 1e-5) - surface.height(radius - 1e-5)) / 2e-5
            assert slope == pytest.approx(math.degrees(math.atan(abs(rise))), abs=1e-5)


def test_sphere_is_its_own_best_sphere(published: Design):
    design = with_mirror(published, kind="ellipsoid", radius_mm=60.0, conic=0.0)
    shape = mirror_shape(design, "direct")
    assert shape.best_sphere_radius_mm == pytest.approx(60.0, rel=1e-9)
    assert shape.sphere_departure_mm < 1e-9


def test_a_mirror_cut_at_its_equator_is_upright_there(published: Design):
    """Its outer radius is the last number below R, where 1 - (r / R)^2 rounds to nothing."""
    design = with_mirror(published, kind="ellipsoid", radius_mm=22.75, conic=0.0, outer_radius_mm=22.749999999999996)
    inner, outer = mirror_shape(design, "direct").slope_deg
    assert inner == pytest.approx(math.degrees(math.asin(17.226 / 22.75)))
    assert outer == 90.0


def test_paraboloid_departs_by_its_spherical_aberration(published: Design):
    """Third order: the departure r^4 / (8 R^3), less its best focus, leaves a quarter of it peak to valley."""
    design = with_mirror(
        published, kind="paraboloid", radius_mm=-400.0, conic=-1.0, inner_radius_mm=0.0, outer_radius_mm=20.0
    )
    shape = mirror_shape(design, "direct")
    assert shape.sphere_departure_mm == pytest.approx(20.0**4 / (32 * 400.0**3), rel=0.01)
    assert shape.focal is None
    assert shape.eccentricity.eccentricity == 1
    assert shape.eccentricity.sheet.shape == "concave"


def test_ellipsoids_that_share_a_focus_below_the_primary(published: Design):
    """A pair with c < 0, whose gain is known: the convex ellipsoidal primary that sees the horizon."""
    record = published.model_dump(mode="json", by_alias=True)
    common = {"kind": "ellipsoid", "thickness_mm": 2.0, "inner_radius_mm": 1.0}
    record["mirrors"][1] |= common | {
        "vertex_mm": 15.071,
        "radius_mm": -7.4264,
        "conic": -0.96,
        "outer_radius_mm": 20.0,
    }
    record["mirrors"][2] |= common | {
        "vertex_mm": 99.51,
        "radius_mm": -163.11,
        "conic": -0.4085,
        "outer_radius_mm": 20.0,
    }
    record["views"]["lower"] |= {"viewpoint_mm": 11.32, "gain": 0.046355}
    design = Design.model_validate(record)
    primary, secondary = mirror_shape(design, "primary"), mirror_shape(design, "secondary")
    assert primary.focal.sheet.second_focus == secondary.focal.sheet.second_focus == "behind"
    assert primary.focal.sheet.shape == "convex"
    assert secondary.focal.sheet.shape == "concave"
    # The prescription is given to four or five digits.
    assert primary.focal.gain * secondary.focal.gain == pytest.approx(0.046355, rel=2e-3)


def test_height_and_diameter_of_the_published_head(published: Design):
    def rim(mirror: Mirror, radius: float) -> float:
        return surface_of(mirror).height(radius)

    top = rim(published.mirror("direct"), 37.0) + 2.0
    bottom = rim(published.mirror("primary"), 37.0) - 2.0
    assert bottom < published.camera.lens_front_mm
    assert overall_height_mm(published) == pytest.approx(top - bottom, rel=1e-12)
    assert overall_diameter_mm(published) == 74.0
    record = published.model_dump(mode="json", by_alias=True)
    record["camera"]["lens_front_mm"] = -60.0
    assert overall_height_mm(Design.model_validate(record)) == pytest.approx(top + 60.0, rel=1e-12)
