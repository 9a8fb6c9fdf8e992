"""Designs written from the closed forms of docs/theory.md, sections 2 to 4, independently of the code under test.

A mirror is its two foci and q; apertures follow from polar form about focus A, rho = c (1 - q^2) / (cos psi - q).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from designer.design import Design

CAMERA = {
    "focal_length_mm": 12.0,
    "pixel_pitch_mm": 0.0044,
    "width_px": 1600,
    "height_px": 1200,
    "f_number": 8.0,
    "lens_radius_mm": 7.0,
    "lens_front_mm": 3.0,
    "lens_length_mm": 40.0,
    "body_radius_mm": 20.0,
}


def conic_mirror(
    name: str,
    focus_a: float,
    focus_b: float,
    q: float,
    faces: str,
    aperture: tuple[float, float],
    thickness: float = 2.0,
) -> dict[str, Any]:
    """A mirror that takes rays of focus A into rays of focus B; q = 0 is the plane halfway between them."""
    d = 1.0 if faces == "down" else -1.0
    c = d * (focus_b - focus_a) / 2.0
    kind = "plane" if q == 0 else ("hyperboloid" if abs(q) < 1 else "ellipsoid")
    return {
        "name": name,
        "kind": kind,
        "vertex_mm": focus_a + d * c * (1.0 + q),
        "radius_mm": None if q == 0 else d * c * (1.0 - q * q) / q,
        "conic": 0.0 if q == 0 else -1.0 / (q * q),
        "inner_radius_mm": aperture[0],
        "outer_radius_mm": aperture[1],
        "thickness_mm": thickness,
        "faces": faces,
    }


def paraboloid(name: str, vertex: float, radius: float, faces: str, aperture: tuple[float, float]) -> dict[str, Any]:
    """A paraboloid of given vertex and signed radius of curvature."""
    return {
        "name": name,
        "kind": "paraboloid",
        "vertex_mm": vertex,
        "radius_mm": radius,
        "conic": -1.0,
        "inner_radius_mm": aperture[0],
        "outer_radius_mm": aperture[1],
        "thickness_mm": 2.0,
        "faces": faces,
    }


def gain(q: float) -> float:
    """kappa = (1 - q) / (1 + q)."""
    return (1.0 - q) / (1.0 + q)


def radius_seen(focus_a: float, focus_b: float, q: float, half_tangent: float, faces: str) -> float:
    """Distance from the axis at which the ray of half-angle tangent t at focus A meets the mirror."""
    d = 1.0 if faces == "down" else -1.0
    c = d * (focus_b - focus_a) / 2.0
    psi = 2.0 * np.arctan(half_tangent)
    return float(abs(c * (1.0 - q * q) / (np.cos(psi) - q) * np.sin(psi)))


def half_tangent(elevation_deg: float, sense: str) -> float:
    """tan(pi/4 +- phi/2): + for a direct view."""
    sign = 1.0 if sense == "direct" else -1.0
    return float(np.tan(np.pi / 4 + sign * np.radians(elevation_deg) / 2))


def view_ranges(
    volume_deg: tuple[float, float], distances: tuple[float, float], baseline: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Elevation ranges of the upper and the lower view that cover a working volume."""
    low, high = np.tan(np.radians(volume_deg))
    half = baseline / 2.0
    near, far = half / distances[0], half / distances[1]
    upper, lower = np.degrees(np.arctan([low - near, high - far])), np.degrees(np.arctan([low + far, high + near]))
    return (float(upper[0]), float(upper[1])), (float(lower[0]), float(lower[1]))


def record(
    mirrors: list[dict[str, Any]],
    upper: dict[str, Any],
    lower: dict[str, Any],
    configuration: str,
    volume: tuple[tuple[float, float], tuple[float, float]] = ((-16.0, 16.0), (1000.0, 5000.0)),
    camera: dict[str, Any] | None = None,
) -> Design:
    """A design record; height and diameter of the mirror system from its rims and vertices."""
    heights = []
    for mirror in mirrors:
        back = mirror["thickness_mm"] if mirror["faces"] == "down" else -mirror["thickness_mm"]
        for radius in (mirror["inner_radius_mm"], mirror["outer_radius_mm"]):
            curvature = 0.0 if mirror["radius_mm"] is None else 1.0 / mirror["radius_mm"]
            root = np.sqrt(1.0 - (1.0 + mirror["conic"]) * (curvature * radius) ** 2)
            face = mirror["vertex_mm"] + curvature * radius**2 / (1.0 + root)
            heights += [face, face + back]
    camera = {**CAMERA, **(camera or {})}
    return Design.model_validate(
        {
            "schema": 1,
            "configuration": configuration,
            "variant": "closed form",
            "camera": camera,
            "mirrors": mirrors,
            "views": {"upper": upper, "lower": lower},
            "baseline_mm": upper["viewpoint_mm"] - lower["viewpoint_mm"],
            "height_mm": float(max(heights) - min([*heights, camera["lens_front_mm"]])),
            "diameter_mm": 2.0 * max(mirror["outer_radius_mm"] for mirror in mirrors),
            "working_volume": {"elevation_deg": list(volume[0]), "distance_mm": list(volume[1])},
            "noise_px": 0.1,
            "score": {},
        }
    )


def folded_hypl_hy(margin: float = 0.15, thickness: float = 2.0) -> Design:
    """The prototype's configuration: baseline 100 mm, 16 degrees up and down at 1 to 5 m."""
    upper_range, lower_range = view_ranges((-16.0, 16.0), (1000.0, 5000.0), 100.0)
    z_lower, z_upper, plane = 0.0, 100.0, 80.0
    widest = np.arctan(2.64 / 12.0)
    kappa_upper = 0.98 * np.tan(widest / 2) / half_tangent(upper_range[1], "direct")
    kappa_lower = 0.90 * kappa_upper * half_tangent(upper_range[0], "direct") / half_tangent(lower_range[0], "folded")
    q_upper, q_lower = (1 - kappa_upper) / (1 + kappa_upper), (1 - kappa_lower) / (1 + kappa_lower)
    t_upper = [kappa_upper * half_tangent(phi, "direct") for phi in upper_range]
    t_lower = [kappa_lower * half_tangent(phi, "folded") for phi in reversed(lower_range)]

    def aperture(radii: list[float]) -> tuple[float, float]:
        return min(radii) - margin, max(radii) + margin

    mirrors = [
        conic_mirror(
            "secondary",
            0.0,
            2 * plane,
            0.0,
            "down",
            (0.0, plane * np.tan(2 * np.arctan(t_lower[1])) + margin),
            thickness,
        ),
        conic_mirror(
            "primary",
            2 * plane,
            z_lower,
            q_lower,
            "up",
            aperture([radius_seen(2 * plane, z_lower, q_lower, t, "up") for t in t_lower]),
            thickness,
        ),
        conic_mirror(
            "direct",
            0.0,
            z_upper,
            q_upper,
            "down",
            aperture([radius_seen(0.0, z_upper, q_upper, t, "down") for t in t_upper]),
            thickness,
        ),
    ]
    upper = {
        "path": ["direct"],
        "viewpoint_mm": z_upper,
        "gain": kappa_upper,
        "sense": "direct",
        "elevation_deg": list(upper_range),
        "zone": "outer",
    }
    lower = {
        "path": ["secondary", "primary"],
        "viewpoint_mm": z_lower,
        "gain": kappa_lower,
        "sense": "folded",
        "elevation_deg": list(lower_range),
        "zone": "inner",
    }
    return record(mirrors, upper, lower, "folded-HyPl-Hy-upper_outer")


def folded(
    secondary: dict[str, Any],
    primary: dict[str, Any],
    kappa: float,
    viewpoint: float,
    elevations: tuple[float, float],
    configuration: str,
) -> Design:
    """A folded pair under a direct mirror that is far out of its way; for tests of the folded view alone."""
    z_upper = viewpoint + 150.0
    q = 0.78
    t = [gain(q) * half_tangent(phi, "direct") for phi in (-10.0, 10.0)]
    radii = [radius_seen(0.0, z_upper, q, value, "down") for value in t]
    upper = {
        "path": ["direct"],
        "viewpoint_mm": z_upper,
        "gain": gain(q),
        "sense": "direct",
        "elevation_deg": [-9.0, 9.0],
        "zone": "outer",
    }
    lower = {
        "path": ["secondary", "primary"],
        "viewpoint_mm": viewpoint,
        "gain": kappa,
        "sense": "folded",
        "elevation_deg": list(elevations),
        "zone": "inner",
    }
    mirrors = [secondary, primary, conic_mirror("direct", 0.0, z_upper, q, "down", (radii[0], radii[1]))]
    camera = {"focal_length_mm": 4.0, "lens_radius_mm": 2.0, "lens_front_mm": 0.5, "body_radius_mm": 2.0}
    # From the middle of the baseline the direct mirror's view allows no more.
    volume = ((-4.0, 4.0), (1000.0, 5000.0))
    return record(mirrors, upper, lower, configuration, volume, camera=camera)


def convex_ellipsoid_pair() -> Design:
    """The traced example of docs/theory.md, section 8: two ellipsoids that share a focus below the primary.

    Its figures are printed to five digits, so only the secondary's q and foci are taken from them and the primary is
    computed exactly.
    """
    q_secondary, q_primary = -1.0 / np.sqrt(0.4085), 1.0 / np.sqrt(0.96)
    c_secondary = 99.51 / (1.0 + q_secondary)
    shared = 2.0 * c_secondary
    viewpoint = 11.32
    c_primary = (shared - viewpoint) / 2.0
    kappa = gain(q_secondary) * gain(q_primary)
    t = [kappa * half_tangent(phi, "folded") for phi in (17.0, -17.0)]
    radii = [radius_seen(0.0, shared, q_secondary, value, "down") for value in t]
    between = [value / gain(q_secondary) for value in t]
    outer = [radius_seen(shared, viewpoint, q_primary, value, "up") for value in between]
    assert c_primary < 0.0
    return folded(
        conic_mirror("secondary", 0.0, shared, q_secondary, "down", (radii[0], radii[1]), 1.0),
        conic_mirror("primary", shared, viewpoint, q_primary, "up", (outer[0], outer[1]), 1.0),
        kappa,
        viewpoint,
        (-16.0, 16.0),
        "folded-ElEl-Hy-upper_outer",
    )


def paraboloid_pair() -> Design:
    """Concave secondary with its focus at the pinhole, convex primary with its focus at the viewpoint."""
    p_secondary, p_primary, viewpoint = 90.0, 5.0, 2.0
    kappa = p_primary / p_secondary
    t = [kappa * half_tangent(phi, "folded") for phi in (17.0, -17.0)]
    radii = (2.0 * p_secondary * t[0], 2.0 * p_secondary * t[1])
    return folded(
        paraboloid("secondary", p_secondary, -2.0 * p_secondary, "down", radii),
        paraboloid("primary", viewpoint + p_primary, -2.0 * p_primary, "up", radii),
        kappa,
        viewpoint,
        (-16.0, 16.0),
        "folded-PaPa-Hy-upper_outer",
    )


def direct_ellipsoid_pair() -> Design:
    """Near field: an upper ellipsoid of negative gain over a lower hyperboloid."""
    volume = ((-8.0, 8.0), (120.0, 250.0))
    baseline = 120.0
    upper_range, lower_range = view_ranges(*volume, baseline)
    z_lower = 150.0
    z_upper = z_lower + baseline
    q_upper = 1.128
    kappa_upper = gain(q_upper)
    q_lower = 0.9
    t_upper = [kappa_upper * half_tangent(phi, "direct") for phi in upper_range]
    t_lower = [gain(q_lower) * half_tangent(phi, "direct") for phi in lower_range]
    radii_upper = [radius_seen(0.0, z_upper, q_upper, abs(t), "down") for t in t_upper]
    radii_lower = [radius_seen(0.0, z_lower, q_lower, t, "down") for t in t_lower]
    mirrors = [
        conic_mirror("lower", 0.0, z_lower, q_lower, "down", (min(radii_lower) - 0.1, max(radii_lower) + 0.1)),
        conic_mirror("upper", 0.0, z_upper, q_upper, "down", (min(radii_upper) - 0.1, max(radii_upper) + 0.1)),
    ]
    views = [
        {
            "path": [name],
            "viewpoint_mm": z,
            "gain": kappa,
            "sense": "direct",
            "elevation_deg": list(elevations),
            "zone": zone,
        }
        for name, z, kappa, elevations, zone in (
            ("upper", z_upper, kappa_upper, upper_range, "inner"),
            ("lower", z_lower, gain(q_lower), lower_range, "outer"),
        )
    ]
    return record(mirrors, views[0], views[1], "direct-HyEl-upper_inner", volume)
