"""The same conic in the forms that papers, opticians and lens-design programs use.

All forms describe the mirror's shape as its own direction d sees it: d points from the light's side to the mirror (up
for a mirror that faces down), and a radius is positive where the mirror is convex. Multiply it by d for the signed
radius of a design file. Lengths in mm.

The focal form is the hub: half the signed distance between the foci, c, and the signed inverse eccentricity q, in
rho(psi) = c (1 - q^2) / (cos(psi) - q) about focus A (docs/theory.md, section 2). Baker and Nayar's (c, k), semi-axes
(a, b, c) and (eccentricity, semi-latus rectum) are even in q, so a :class:`Sheet` is kept beside them. A paraboloid
has no finite c and a plane no finite eccentricity: they have the forms that exist, and the others say so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from designer.design import ConicKind
from designer.optics.kinds import gain_of, kind_of_conic

Shape = Literal["convex", "flat", "concave"]
SecondFocus = Literal["ahead", "behind"]


@dataclass(frozen=True, slots=True)
class Sheet:
    """What forms that are even in q forget: convex or concave, and whether focus B lies along d from A (c > 0)."""

    shape: Shape
    second_focus: SecondFocus = "ahead"


@dataclass(frozen=True, slots=True)
class FocalForm:
    """Half the signed distance c from focus A to focus B along d, and the signed inverse eccentricity q."""

    half_focal_distance: float
    inverse_eccentricity: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.half_focal_distance) and math.isfinite(self.inverse_eccentricity)):
            raise ValueError(
                "the focal form needs two distinct finite foci, which a paraboloid or a sphere does not have"
            )
        if self.half_focal_distance == 0:
            raise ValueError("the two foci coincide: a sphere has no gain")
        if abs(self.inverse_eccentricity) == 1:
            raise ValueError("inverse eccentricity 1 is a paraboloid, whose second focus is at infinity")

    @property
    def kind(self) -> ConicKind:
        """Plane, hyperboloid or ellipsoid."""
        if self.inverse_eccentricity == 0:
            return "plane"
        return "hyperboloid" if abs(self.inverse_eccentricity) < 1 else "ellipsoid"

    @property
    def gain(self) -> float:
        """The gain kappa = (1 - q) / (1 + q) in t_A = kappa t_B."""
        return float(gain_of(self.inverse_eccentricity))

    @property
    def vertex_distance(self) -> float:
        """Signed distance from focus A to the vertex along d: c (1 + q)."""
        return self.half_focal_distance * (1 + self.inverse_eccentricity)

    @property
    def sheet(self) -> Sheet:
        """Convex, flat or concave, and on which side of focus A focus B lies."""
        q = self.inverse_eccentricity
        bulge = self.half_focal_distance * (1 - q * q) * q
        shape: Shape = "flat" if bulge == 0 else "convex" if bulge > 0 else "concave"
        return Sheet(shape, "ahead" if self.half_focal_distance > 0 else "behind")


@dataclass(frozen=True, slots=True)
class VertexForm:
    """Radius of curvature at the vertex, positive where convex, and conic constant K; a plane is (inf, 0)."""

    radius: float
    conic_constant: float

    def __post_init__(self) -> None:
        if self.radius == 0 or math.isnan(self.radius):
            raise ValueError(f"radius of curvature must not be {self.radius}")

    @property
    def kind(self) -> ConicKind:
        """Kind of the conic; a sphere counts as an ellipsoid."""
        if math.isinf(self.radius):
            return "plane"
        return kind_of_conic(self.conic_constant).word

    @property
    def shape(self) -> Shape:
        """Convex, flat or concave."""
        return "flat" if math.isinf(self.radius) else "convex" if self.radius > 0 else "concave"


@dataclass(frozen=True, slots=True)
class BakerNayarForm:
    """The paper's equation (1): half the distance between viewpoint and pinhole, and the constant k.

    ``kind`` picks the branch: hyperboloid and plane have a pure number k >= 2, the ellipsoid k > 0 in mm^2. Baker
    and Nayar's own c is the whole distance.
    """

    half_focal_distance: float
    k: float
    kind: ConicKind
    sheet: Sheet


@dataclass(frozen=True, slots=True)
class SemiAxesForm:
    """Semi-axis a along the optical axis, semi-axis b across it, and c: c^2 = a^2 + b^2 or, if a > c, a^2 - b^2."""

    a: float
    b: float
    c: float
    sheet: Sheet


@dataclass(frozen=True, slots=True)
class EccentricityForm:
    """Eccentricity e and semi-latus rectum: the polar form l / (1 + e cos) of orbits; not for a plane."""

    eccentricity: float
    semi_latus_rectum: float
    sheet: Sheet


def vertex_from_focal(form: FocalForm) -> VertexForm:
    """Radius c (1 - q^2) / q and conic constant -1 / q^2; a plane gives (inf, 0)."""
    q = form.inverse_eccentricity
    if q == 0:
        return VertexForm(math.inf, 0.0)
    return VertexForm(form.half_focal_distance * (1 - q) * (1 + q) / q, -1 / (q * q))


def focal_from_vertex(form: VertexForm, second_focus: SecondFocus = "ahead") -> FocalForm:
    """The focal form of a hyperboloid or ellipsoid; an ellipsoid may take either of its foci as A.

    Raises
    ------
    ValueError
        A plane (its vertex form does not say where its foci are), a paraboloid, a sphere, or a conic constant above
        zero (an oblate ellipsoid, whose foci are off the axis).
    """
    if form.kind == "plane":
        raise ValueError("the vertex form of a plane does not say where its foci are")
    if form.kind == "paraboloid":
        raise ValueError("the second focus of a paraboloid is at infinity: it has no focal form")
    if form.conic_constant >= 0:
        raise ValueError(f"conic constant {form.conic_constant:g} has no two foci on the axis")
    magnitude = 1 / math.sqrt(-form.conic_constant)
    side = 1.0 if second_focus == "ahead" else -1.0
    q = math.copysign(magnitude, form.radius * side * (1 - magnitude))
    # 1 - q^2 from 1 + K keeps its digits near a paraboloid.
    one_minus_q_squared = (1 + form.conic_constant) / form.conic_constant
    return FocalForm(form.radius * q / one_minus_q_squared, q)


def baker_nayar_from_focal(form: FocalForm) -> BakerNayarForm:
    """Equation (1): k = 2 / (1 - q^2) for hyperboloid and plane, k = 2 c^2 (q^2 - 1) for an ellipsoid."""
    q = form.inverse_eccentricity
    one_minus_q_squared = (1 - q) * (1 + q)
    half_distance = abs(form.half_focal_distance)
    k = 2 / one_minus_q_squared if form.kind != "ellipsoid" else -2 * half_distance**2 * one_minus_q_squared
    return BakerNayarForm(half_distance, k, form.kind, form.sheet)


def focal_from_baker_nayar(form: BakerNayarForm) -> FocalForm:
    """The focal form behind the paper's equation (1).

    Raises
    ------
    ValueError
        A paraboloid, k outside its branch, or a half distance that is not positive.
    """
    c = _positive(form.half_focal_distance, "half focal distance")
    if form.kind == "paraboloid":
        raise ValueError("a paraboloid is a limit of equation (1), not a pair (c, k)")
    if form.kind == "ellipsoid":
        return _focal(c, math.sqrt(1 + _positive(form.k, "k of an ellipsoid") / (2 * c * c)), form.sheet)
    if not (form.k > 2 if form.kind == "hyperboloid" else form.k == 2):
        raise ValueError(f"k of a {form.kind} cannot be {form.k:g}: it is above 2 for a hyperboloid, 2 for a plane")
    return _focal(c, math.sqrt((form.k - 2) / form.k), form.sheet)


def semi_axes_from_focal(form: FocalForm) -> SemiAxesForm:
    """Semi-axes a = c q and b = c sqrt(abs(1 - q^2)), as magnitudes; a plane has a = 0 and b = c."""
    c = abs(form.half_focal_distance)
    q = abs(form.inverse_eccentricity)
    return SemiAxesForm(c * q, c * math.sqrt(abs((1 - q) * (1 + q))), c, form.sheet)


def focal_from_semi_axes(form: SemiAxesForm) -> FocalForm:
    """The focal form behind (a, b, c).

    Raises
    ------
    ValueError
        The three do not belong together (c^2 = a^2 + b^2, or a^2 - b^2 for an ellipsoid), or are not lengths.
    """
    c = _positive(form.c, "c")
    b = _positive(form.b, "b")
    if form.a < 0:
        raise ValueError(f"a must not be negative, not {form.a:g}")
    expected = math.sqrt(abs((c - form.a) * (c + form.a)))
    # b^2 is a difference of squares: near a paraboloid it inherits the rounding of a and c, not its own.
    if abs(b * b - expected * expected) > 1e-9 * max(form.a, c) ** 2:
        raise ValueError(f"b = {b:g} does not belong to a = {form.a:g} and c = {c:g}: it should be {expected:g}")
    return _focal(c, form.a / c, form.sheet)


def eccentricity_from_vertex(form: VertexForm, second_focus: SecondFocus = "ahead") -> EccentricityForm:
    """Eccentricity sqrt(-K) and semi-latus rectum abs(radius).

    Raises
    ------
    ValueError
        A plane (its eccentricity is infinite) or a conic constant above zero.
    """
    if form.kind == "plane":
        raise ValueError("the eccentricity of a plane is infinite")
    if form.conic_constant > 0:
        raise ValueError(
            f"conic constant {form.conic_constant:g} is an oblate ellipsoid: no eccentricity about the axis"
        )
    return EccentricityForm(math.sqrt(-form.conic_constant), abs(form.radius), Sheet(form.shape, second_focus))


def vertex_from_eccentricity(form: EccentricityForm) -> VertexForm:
    """Signed radius and conic constant -e^2.

    Raises
    ------
    ValueError
        A flat sheet, an infinite or negative eccentricity, or a semi-latus rectum that is not positive.
    """
    if form.sheet.shape == "flat" or not 0 <= form.eccentricity < math.inf:
        raise ValueError("a plane has no finite eccentricity, and an eccentricity is never negative")
    radius = _positive(form.semi_latus_rectum, "semi-latus rectum")
    return VertexForm(radius if form.sheet.shape == "convex" else -radius, -(form.eccentricity**2))


def _focal(half_distance: float, magnitude: float, sheet: Sheet) -> FocalForm:
    """Focal form from magnitudes and the sheet."""
    if (magnitude == 0) != (sheet.shape == "flat"):
        raise ValueError(f"a {sheet.shape} sheet does not go with inverse eccentricity {magnitude:g}")
    c = half_distance if sheet.second_focus == "ahead" else -half_distance
    bulge = {"convex": 1.0, "flat": 0.0, "concave": -1.0}[sheet.shape]
    return FocalForm(c, math.copysign(magnitude, bulge * c * (1 - magnitude)) if magnitude else 0.0)


def _positive(value: float, name: str) -> float:
    if not (value > 0 and math.isfinite(value)):
        raise ValueError(f"{name} must be a positive length or number, not {value:g}")
    return value
