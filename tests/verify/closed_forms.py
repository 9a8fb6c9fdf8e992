"""Designs written from the closed forms of the design notes (section 2), independently of the code under test.

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
