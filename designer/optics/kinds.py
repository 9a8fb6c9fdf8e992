"""Kinds of conic and what follows from a kind: the signs of its radius, its gain, its inverse eccentricity.

A mirror of vertex z_V, radius R and conic constant K has a focus z_A with K = -(1 + R / v)^2, v = z_V - z_A, that is
K = -1 / q^2 with the inverse eccentricity q = v / (v + R) (docs/theory.md, section 2). A mirror that gives its view
alone (lower, upper, direct) has q > 0 and its foci at the pinhole and at the viewpoint z_F, so that
v = z_F (1 + q) / 2, R = z_F (1 - q^2) / (2 q), and the gain is (1 - q) / (1 + q): two numbers fix all the others.
Lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from designer.configurations import FLATTEST, MOST_PARABOLIC, MirrorKind
from designer.optics.backend import Scalar


def gain_of(inverse_eccentricity: Scalar) -> Scalar:
    """The gain kappa = (1 - q) / (1 + q) of a mirror."""
    return (1 - inverse_eccentricity) / (1 + inverse_eccentricity)


CONVEX_HYPERBOLOID_GAINS: tuple[float, float] = (gain_of(MOST_PARABOLIC), gain_of(FLATTEST))
"""Least and greatest gain of a convex hyperboloid in a folding pair."""
ELLIPSOID_GAINS: tuple[float, float] = (gain_of(1.0 / FLATTEST), gain_of(1.0 / MOST_PARABOLIC))
"""Least and greatest gain of an ellipsoid in a folding pair, both negative."""


def kind_of_conic(conic_constant: float) -> MirrorKind:
    """The kind of a curved mirror by its conic constant; a sphere counts as an ellipsoid."""
    if conic_constant == -1.0:
        return MirrorKind.PARABOLOID
    return MirrorKind.HYPERBOLOID if conic_constant < -1.0 else MirrorKind.ELLIPSOID


def kind_of_single_mirror(inverse_eccentricity: float) -> MirrorKind:
    """The kind of a mirror that gives its view alone, by its inverse eccentricity q > 0."""
    return MirrorKind.ELLIPSOID if inverse_eccentricity > 1 else MirrorKind.HYPERBOLOID


def conic_with_focus(vertex_distance: float, radius: float) -> float:
    """The conic constant -(1 + R / v)^2 that puts a focus a signed distance v below the vertex; -inf for v = 0."""
    return -((1.0 + radius / vertex_distance) ** 2) if vertex_distance else -math.inf


def radius_signs(name: str, kind: MirrorKind, *, may_share_focus_below: bool) -> frozenset[int]:
    """The signs that the radius of a curved mirror may have; facing down, positive is convex, facing up concave.

    Parameters
    ----------
    name
        The mirror's name in the design record; only the primary faces up.
    kind
        Not a plane.
    may_share_focus_below
        Whether the folding pair may be the two ellipsoids whose primary is convex.
    """
    if name == "primary":
        if kind is MirrorKind.HYPERBOLOID:
            return frozenset({-1})
        either = kind is MirrorKind.PARABOLOID or may_share_focus_below
        return frozenset({-1, 1}) if either else frozenset({1})
    if kind is MirrorKind.HYPERBOLOID:
        return frozenset({-1, 1}) if name == "secondary" else frozenset({1})
    return frozenset({-1})


def inverse_eccentricities(mirror: Mapping[str, float], view: Mapping[str, float]) -> list[tuple[str, float]]:
    """Each way in which numbers of a mirror that gives its view alone fix q, in words, and the q it gives.

    Parameters
    ----------
    mirror
        Any of radius_mm, conic and vertex_mm.
    view
        Any of viewpoint_mm and gain, of the view that the mirror gives.
    """
    vertex, radius = mirror.get("vertex_mm"), mirror.get("radius_mm")
    viewpoint = view.get("viewpoint_mm")
    found = []
    if "conic" in mirror:
        found.append(("conic", 1.0 / math.sqrt(-mirror["conic"])))
    if vertex is not None and radius is not None:
        found.append(("vertex_mm with radius_mm", vertex / (vertex + radius) if vertex != -radius else math.inf))
    if vertex is not None and viewpoint is not None:
        found.append(("vertex_mm with the view's viewpoint_mm", 2.0 * vertex / viewpoint - 1.0))
    if radius is not None and viewpoint is not None:
        q = (math.hypot(radius, viewpoint) - radius) / viewpoint
        found.append(("radius_mm with the view's viewpoint_mm", q))
    if "gain" in view:
        # The relation is its own inverse: q = (1 - kappa) / (1 + kappa).
        found.append(("the view's gain", gain_of(view["gain"])))
    return found
