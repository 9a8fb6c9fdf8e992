"""Confocal designs of every kind of mirror and either sign of gain, drawn by Hypothesis and written from closed forms.

A mirror is the signed distance v from a focus to its vertex and the ratio mu of the half-angle tangents at its two
foci: radius 2 v / (mu - 1), conic constant -((mu + 1) / (mu - 1))^2. Independent of the code under test.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from designer.design import Design
from support.closed_forms import half_tangent, record

# Tangent ratios of each kind, seen from the focus on the mirror's near side.
RATIOS = {
    "plane": st.just(1.0),
    "paraboloid": st.just(0.0),
    "convex hyperboloid": st.floats(1.2, 12.0),
    "concave hyperboloid": st.floats(0.05, 0.9),
    "ellipsoid": st.floats(-12.0, -0.05),
}
CAMERA = {"focal_length_mm": 4.0, "lens_radius_mm": 2.0, "lens_front_mm": 0.5, "body_radius_mm": 2.0}
VOLUME = ((-4.0, 4.0), (1000.0, 5000.0))


def mirror(name: str, focus: float, distance: float, ratio: float, faces: str, tangents: list[float]) -> dict[str, Any]:
    """A mirror by one focus; its aperture holds the rays of the half-angle tangents at that focus."""
    radii = [abs(2.0 * distance * t / (1.0 - ratio * t * t)) for t in tangents]
    is_plane = ratio == 1.0
    return {
        "name": name,
        "kind": "plane"
        if is_plane
        else "paraboloid"
        if ratio == 0.0
        else "hyperboloid"
        if ratio > 0.0
        else "ellipsoid",
        "vertex_mm": focus + distance,
        "radius_mm": None if is_plane else 2.0 * distance / (ratio - 1.0),
        "conic": 0.0 if is_plane else -(((ratio + 1.0) / (ratio - 1.0)) ** 2),
        "inner_radius_mm": 0.999 * min(radii),
        "outer_radius_mm": 1.001 * max(radii),
        "thickness_mm": 0.0,
        "faces": faces,
    }


def direct_design(gain: float, viewpoint: float, elevations: tuple[float, float], **camera: float) -> Design:
    """Two mirrors above the lens; the upper view has the given gain and viewpoint."""
    mirrors, views = [], []
    for name, kappa, height in (("lower", 0.03, viewpoint / 2.0), ("upper", gain, viewpoint)):
        tangents = [kappa * half_tangent(phi, "direct") for phi in elevations]
        mirrors.append(mirror(name, 0.0, height / (1.0 + kappa), 1.0 / kappa, "down", tangents))
        views.append(_view([name], height, kappa, "direct", elevations, "outer" if name == "upper" else "inner"))
    return record(mirrors, views[1], views[0], "direct-HyHy-upper_outer", VOLUME, {**CAMERA, **camera})


def folded_design(
    gain: float,
    ratio: float,
    secondary: float,
    viewpoint: float,
    elevations: tuple[float, float],
    **camera: float,
) -> Design:
    """A folded pair: secondary of that vertex height and tangent ratio, primary confocal with it and the viewpoint."""
    distance = gain * (secondary * (1.0 + ratio) - ratio * viewpoint) / (1.0 + gain * ratio)
    # A plane but for the last digit is a plane.
    primary_ratio = 1.0 if abs(gain * ratio - 1.0) < 1e-9 else gain * ratio
    at_viewpoint = [half_tangent(phi, "folded") for phi in elevations]
    upper = viewpoint + 150.0
    at_upper = [0.05 * half_tangent(phi, "direct") for phi in elevations]
    mirrors = [
        mirror("secondary", 0.0, secondary, ratio, "down", [gain * t for t in at_viewpoint]),
        mirror("primary", viewpoint, distance, primary_ratio, "up", at_viewpoint),
        mirror("direct", 0.0, upper / 1.05, 20.0, "down", at_upper),
    ]
    views = [
        _view(["direct"], upper, 0.05, "direct", elevations, "outer"),
        _view(["secondary", "primary"], viewpoint, gain, "folded", elevations, "inner"),
    ]
    return record(mirrors, views[0], views[1], "folded-HyHy-Hy-upper_outer", VOLUME, {**CAMERA, **camera})


@st.composite
def folded_designs(draw: st.DrawFn) -> Design:
    """Folded pairs of all kinds, gains of both signs; not all of them can be traced."""
    gain = draw(st.floats(0.02, 0.3)) * draw(st.sampled_from([1.0, -1.0]))
    ratio = draw(st.sampled_from(sorted(RATIOS)).flatmap(RATIOS.__getitem__))
    # That of the secondary, or of the primary, which is gain times the secondary's.
    ratio /= draw(st.sampled_from([1.0, gain]))
    elevations = (draw(st.floats(-40.0, 30.0)), draw(st.floats(5.0, 20.0)))
    elevations = (elevations[0], elevations[0] + elevations[1])
    secondary, viewpoint = draw(st.floats(40.0, 150.0)), draw(st.floats(-60.0, 60.0))
    largest = max(half_tangent(phi, "folded") for phi in elevations) ** 2
    assume(max(abs(gain * ratio), abs(gain * gain * ratio)) * largest < 0.9)
    assume(abs(1.0 + gain * ratio) > 0.05)
    distance = gain * (secondary * (1.0 + ratio) - ratio * viewpoint) / (1.0 + gain * ratio)
    # No mirror curves within a fraction of a millimetre.
    assume(abs(distance) > 0.5 * max(1.0, abs(gain * ratio - 1.0)))
    return folded_design(gain, ratio, secondary, viewpoint, elevations)


@st.composite
def direct_designs(draw: st.DrawFn) -> Design:
    """Direct mirrors: hyperboloids (gain above 0) and ellipsoids (below)."""
    gain = draw(st.floats(0.03, 0.3)) * draw(st.sampled_from([1.0, -1.0]))
    low = draw(st.floats(-40.0, 10.0))
    elevations = (low, low + draw(st.floats(5.0, 20.0)))
    return direct_design(gain, draw(st.floats(60.0, 300.0)), elevations)


def _view(
    path: list[str], viewpoint: float, gain: float, sense: str, elevations: tuple[float, float], zone: str
) -> dict[str, Any]:
    return {
        "path": path,
        "viewpoint_mm": viewpoint,
        "gain": gain,
        "sense": sense,
        "elevation_deg": list(elevations),
        "zone": zone,
    }


def kind_of(design: Design, name: str) -> str:
    """Kind of a mirror and which way its face bulges."""
    found = design.mirror(name)
    if found.radius_mm is None:
        return "plane"
    towards = -1.0 if found.faces == "down" else 1.0
    return f"{'convex' if np.sign(found.radius_mm) == -towards else 'concave'} {found.kind}"
