"""A conic of revolution seen from one of its foci: two numbers that stay finite for every kind.

They are v, the signed distance from the focus to the vertex, and the tangent ratio mu: the tangent of a ray's half
angle at the other focus over that at this one (docs/theory.md, sections 2 and 3). They describe every mirror without a
0/0:

    R = 2 v t / (1 - mu t^2),   z = z_focus + v (1 - t^2) / (1 - mu t^2),   t = tan(angle at the focus from +z / 2)

Seen from focus A, on the camera's side, mu is 1 / kappa, with the gain kappa = (1 - q) / (1 + q). Then mu = 1 is a
plane, mu > 1 a convex hyperboloid, 0 < mu < 1 a concave one, mu = 0 a paraboloid (second focus at infinity) and mu < 0
an ellipsoid; -1 < mu < 0 is the ellipsoid whose second focus lies behind focus A (c < 0). Seen from focus B mu is
kappa, which is how a primary is written: from the effective viewpoint, so that a second focus at infinity does no harm.

All functions take floats, NumPy arrays or CasADi symbols; lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.optics.backend import Scalar, maximum, sqrt

# Below this, 1 - (1 + K) c^2 r^2 is held while a solver probes radii that the conic does not reach.
SMALLEST_SAG_DISCRIMINANT = 1e-6


@dataclass(frozen=True, slots=True)
class Surface:
    """A conic as its vertex equation has it: z(r) = z_vertex + c r^2 / (1 + sqrt(1 - (1 + K) c^2 r^2)).

    ``conic_term`` is (1 + K) c^2 in 1/mm^2, finite where K is not (a plane as the limit of hyperboloids).
    """

    vertex_height: Scalar
    curvature: Scalar
    conic_term: Scalar

    def height(self, radius: Scalar) -> Scalar:
        """Height z of the vertex sheet at distance ``radius`` from the axis."""
        squared = radius * radius
        root = sqrt(maximum(1.0 - self.conic_term * squared, SMALLEST_SAG_DISCRIMINANT))
        return self.vertex_height + self.curvature * squared / (1.0 + root)


@dataclass(frozen=True, slots=True)
class FocalConic:
    """A mirror by one of its foci.

    ``vertex_distance`` is the signed distance from the focus up to the vertex. ``tangent_ratio`` is the half-angle
    tangent at the other focus over that at this one: 1 / kappa if this is focus A, kappa if it is focus B.
    """

    focus_height: Scalar
    vertex_distance: Scalar
    tangent_ratio: Scalar

    @property
    def surface(self) -> Surface:
        """The mirror by vertex, curvature and (1 + K) c^2."""
        return Surface(
            vertex_height=self.focus_height + self.vertex_distance,
            curvature=(self.tangent_ratio - 1.0) / (2.0 * self.vertex_distance),
            conic_term=-self.tangent_ratio / (self.vertex_distance * self.vertex_distance),
        )

    @property
    def other_focus_height(self) -> Scalar:
        """Height of the second focus; infinite for a paraboloid."""
        return self.focus_height + self.vertex_distance * (1.0 + 1.0 / self.tangent_ratio)

    def point(self, half_tangent: Scalar) -> tuple[Scalar, Scalar]:
        """(R, z) where the ray at half-angle tangent t from this focus meets the mirror; R carries t's sign."""
        squared = half_tangent * half_tangent
        scale = self.vertex_distance / (1.0 - self.tangent_ratio * squared)
        return 2.0 * scale * half_tangent, self.focus_height + scale * (1.0 - squared)


def conic_constant(tangent_ratio: Scalar) -> Scalar:
    """Conic constant K = -1/q^2 = -((mu + 1) / (mu - 1))^2; not for a plane (mu = 1)."""
    ratio = (tangent_ratio + 1.0) / (tangent_ratio - 1.0)
    return -ratio * ratio
