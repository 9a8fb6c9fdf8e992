"""Symbolic proofs: the paper's equations (1)-(9) and those of docs/theory.md, sections 2 to 5, follow from one law.

Nothing here is sampled. An identity in angles becomes one between rational functions once every angle is written by
the tangent of its half, and ``is_zero`` decides it by cancelling to the zero polynomial. The program's own functions
are proved too: they run on SymPy symbols, with only the square root replaced.

Frame: focus A (the pinhole) at the origin, focus B (the viewpoint) at (0, 2c), Z along the axis, the mirror faces
down. A mirror that faces up is the same one upside down. An identity between rational functions holds for c < 0 too.
"""

from __future__ import annotations

from itertools import product

import pytest
import sympy as sp

from designer.design import PerView
from designer.evaluate import depth
from designer.optics import view
from designer.optics.conic import FocalConic, conic_constant

c, f, t, t_a, p, p_other = sp.symbols("c f t t_a p p_other", positive=True)
q, mu, kappa, m, phi = sp.symbols("q mu kappa m phi", real=True)

# Inverse eccentricity of each kind, so that p > 0 runs through the whole of it.
KINDS = {
    "convex hyperboloid": 1 / (1 + p),
    "concave hyperboloid": -1 / (1 + p),
    "ellipsoid": 1 + p,
    "plane": sp.Integer(0),
}
CURVED = [name for name in KINDS if name != "plane"]

# tan(phi) and its secant, by t = tan(pi/4 + phi/2) of a direct view and t = tan(pi/4 - phi/2) of a folded one.
SLOPE_DIRECT = (t - 1 / t) / 2
SLOPE_FOLDED = (1 / t - t) / 2
SECANT = (t + 1 / t) / 2


def is_zero(expression: sp.Expr) -> bool:
    return sp.cancel(sp.together(expression)) == 0


def square_root(value: sp.Expr) -> sp.Expr:
    """Square root that sees perfect squares of positive quantities."""
    return sp.sqrt(sp.factor(value))


def gain(inverse_eccentricity: sp.Expr) -> sp.Expr:
    return (1 - inverse_eccentricity) / (1 + inverse_eccentricity)


def law(gain_value: sp.Expr, half_tangent: sp.Expr) -> sp.Expr:
    """Image radius f tan(psi) when tan(psi/2) = kappa t."""
    tangent = gain_value * half_tangent
    return f * 2 * tangent / (1 - tangent**2)


def polar_point(inverse_eccentricity: sp.Expr) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """(R, Z) and rho of rho(psi) = c (1 - q^2) / (cos psi - q), by t_a = tan(psi/2)."""
    cosine, sine = (1 - t_a**2) / (1 + t_a**2), 2 * t_a / (1 + t_a**2)
    rho = c * (1 - inverse_eccentricity**2) / (cosine - inverse_eccentricity)
    return rho * sine, rho * cosine, rho


def test_secant_belongs_to_both_slopes():
    for slope in (SLOPE_DIRECT, SLOPE_FOLDED):
        assert is_zero(SECANT**2 - 1 - slope**2)
    angle = sp.pi / 4 + phi / 2
    direct = (sp.tan(angle) - 1 / sp.tan(angle)) / 2
    assert sp.simplify((direct - sp.tan(phi)).rewrite(sp.cos)) == 0


# Equation (1)


def test_equation_1_first_branch_is_the_conic_of_hyperboloids_and_planes():
    k = 2 / (1 - q**2)
    radius, height, _ = polar_point(q)
    assert is_zero((height - c) ** 2 - radius**2 * (k / 2 - 1) - c**2 * (k - 2) / k)
    for kind in ("convex hyperboloid", "concave hyperboloid"):
        assert sp.factor(k.subs(q, KINDS[kind]) - 2).is_positive
    assert k.subs(q, 0) == 2


def test_equation_1_second_branch_is_the_conic_of_ellipsoids():
    k = 2 * c**2 * (q**2 - 1)
    radius, height, _ = polar_point(q)
    assert is_zero((height - c) ** 2 + radius**2 * (1 + 2 * c**2 / k) - (k + 2 * c**2) / 2)
    assert sp.expand(k.subs(q, KINDS["ellipsoid"])).is_positive


# The gain law from the law of reflection


def test_conic_reflects_every_ray_of_one_focus_into_one_of_the_other():
    radius, height, rho = polar_point(q)
    # Signed distance from B: negative where the light crosses the axis there (an ellipsoid).
    distance_b = rho - 2 * c * q
    assert is_zero(distance_b**2 - radius**2 - (height - 2 * c) ** 2)
    incoming = (radius / rho, height / rho)
    outgoing = (radius / distance_b, (height - 2 * c) / distance_b)
    tangent = (sp.diff(radius, t_a), sp.diff(height, t_a))
    # A mirror changes only the normal part of a direction.
    assert is_zero(sum((b - a) * s for a, b, s in zip(incoming, outgoing, tangent, strict=True)))


def test_gain_law():
    radius, height, rho = polar_point(q)
    distance_b = rho - 2 * c * q
    # tan of half the angle at B between B->A (down) and the direction to the world.
    t_b = radius / (distance_b + 2 * c - height)
    assert is_zero(t_a - gain(q) * t_b)


def test_ellipsoid_alone_sends_the_light_across_the_axis():
    assert gain(KINDS["convex hyperboloid"]).simplify().is_positive
    assert gain(KINDS["concave hyperboloid"]).simplify().is_positive
    assert gain(KINDS["plane"]) == 1
    assert gain(KINDS["ellipsoid"]).simplify().is_negative
    assert gain(-(1 + p)).simplify().is_negative


def test_vertex_radius_and_conic_constant():
    radius, height, _ = polar_point(q)
    assert is_zero(height.subs(t_a, 0) - c * (1 + q))
    vertex_radius, conic = c * (1 - q**2) / q, -1 / q**2
    sag = height - c * (1 + q)
    assert is_zero(radius**2 - 2 * vertex_radius * sag + (1 + conic) * sag**2)


# Equations (2)-(5)


def hyperboloid_point(axis: sp.Expr, slope: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    b_squared = c**2 - axis**2
    radius = b_squared * (slope * c + axis * SECANT) / (axis**2 - slope**2 * b_squared)
    return radius, slope * radius + 2 * c


def ellipsoid_point(axis: sp.Expr, slope: sp.Expr, sign: int = -1) -> tuple[sp.Expr, sp.Expr]:
    b_squared = axis**2 - c**2
    radius = sign * b_squared * (slope * c + axis * SECANT) / (axis**2 + slope**2 * b_squared)
    return radius, slope * radius + 2 * c


@pytest.mark.parametrize("kind", CURVED)
def test_equations_2_to_5_are_the_gain_law(kind: str):
    """A concave hyperboloid is the other sheet of equation (4): a < 0."""
    inverse_eccentricity = KINDS[kind]
    point = ellipsoid_point if kind == "ellipsoid" else hyperboloid_point
    radius, height = point(c * inverse_eccentricity, SLOPE_DIRECT)
    assert is_zero(f * radius / height - law(gain(inverse_eccentricity), t))


@pytest.mark.parametrize("kind", CURVED)
def test_equation_4_lies_on_equation_1(kind: str):
    inverse_eccentricity = KINDS[kind]
    if kind == "ellipsoid":
        radius, height = ellipsoid_point(c * inverse_eccentricity, SLOPE_DIRECT)
        k = 2 * c**2 * (inverse_eccentricity**2 - 1)
        assert is_zero((height - c) ** 2 + radius**2 * (1 + 2 * c**2 / k) - (k + 2 * c**2) / 2)
    else:
        radius, height = hyperboloid_point(c * inverse_eccentricity, SLOPE_DIRECT)
        k = 2 / (1 - inverse_eccentricity**2)
        assert is_zero((height - c) ** 2 - radius**2 * (k / 2 - 1) - c**2 * (k - 2) / k)


def test_minus_sign_of_the_ellipsoid_in_equation_4_is_real():
    inverse_eccentricity = KINDS["ellipsoid"]
    k = 2 * c**2 * (inverse_eccentricity**2 - 1)
    radius, _ = ellipsoid_point(c * inverse_eccentricity, SLOPE_DIRECT)
    # R_M < 0 for every slope and every ellipsoid: c, p and t are positive and so is every coefficient.
    assert sp.factor(-radius).is_positive
    flipped, flipped_height = ellipsoid_point(c * inverse_eccentricity, SLOPE_DIRECT, sign=1)
    assert not is_zero((flipped_height - c) ** 2 + flipped**2 * (1 + 2 * c**2 / k) - (k + 2 * c**2) / 2)


@pytest.mark.parametrize("kind", ["convex hyperboloid", "ellipsoid"])
def test_form_of_equation_4_that_is_free_of_0_by_0(kind: str):
    axis = c * KINDS[kind]
    if kind == "ellipsoid":
        radius, _ = ellipsoid_point(axis, SLOPE_DIRECT)
        free = -(axis**2 - c**2) / (axis * SECANT - SLOPE_DIRECT * c)
    else:
        radius, _ = hyperboloid_point(axis, SLOPE_DIRECT)
        free = (c**2 - axis**2) / (axis * SECANT - SLOPE_DIRECT * c)
    assert is_zero(radius - free)


def test_plane_is_the_limit_of_equation_4():
    axis = sp.symbols("a", positive=True)
    radius, height = hyperboloid_point(axis, SLOPE_DIRECT)
    # A plane halfway between its foci, and a gain of one.
    assert is_zero(sp.limit(sp.cancel(height), axis, 0) - c)
    assert is_zero(f * sp.cancel(radius / height).subs(axis, 0) - law(sp.Integer(1), t))


# Folded views and the pair of paraboloids, equations (6)-(9)


def test_equations_6_to_9_are_the_gain_law():
    p_primary, p_secondary = sp.symbols("p_1 p_2", real=True, nonzero=True)
    radius = 2 * p_primary * (SECANT - SLOPE_FOLDED)
    height = -(radius**2) / (4 * p_secondary) + p_secondary
    assert is_zero(radius - 2 * p_primary * t)
    assert is_zero(f * radius / height - law(p_primary / p_secondary, t))


def test_primary_paraboloid_sends_every_ray_of_the_viewpoint_along_the_axis():
    p_primary, e = sp.symbols("p_1 e", real=True, nonzero=True)
    radius, height = 2 * p_primary * t, e + p_primary * (1 - t**2)
    # Equation (9): the point lies on the line of slope m through the viewpoint (0, e).
    assert is_zero((height - e) / radius - SLOPE_FOLDED)
    # Vertex at e + p1, radius of curvature -2 p1, K = -1.
    assert is_zero(radius**2 - 2 * (-2 * p_primary) * (height - e - p_primary))
    # The law of reflection, from the world's direction to the vertical.
    outgoing = (radius / (p_primary * (1 + t**2)), (height - e) / (p_primary * (1 + t**2)))
    assert is_zero(outgoing[0] ** 2 + outgoing[1] ** 2 - 1)
    tangent = (sp.diff(radius, t), sp.diff(height, t))
    assert is_zero(outgoing[0] * tangent[0] + (outgoing[1] + 1) * tangent[1])


def test_secondary_paraboloid_by_its_vertex():
    p_secondary = sp.symbols("p_2", positive=True)
    cosine, sine = (1 - t_a**2) / (1 + t_a**2), 2 * t_a / (1 + t_a**2)
    rho = 2 * p_secondary / (1 + cosine)
    assert is_zero(rho * sine - 2 * p_secondary * t_a)
    # Equation (7).
    assert is_zero(rho * cosine - (p_secondary - (rho * sine) ** 2 / (4 * p_secondary)))


def test_paraboloid_pair_is_the_limit_of_pairs_with_a_shared_focus():
    p_primary, p_secondary, vertex_primary = sp.symbols("p_1 p_2 z_1", real=True, nonzero=True)
    shared_focus = FocalConic(sp.Integer(0), p_secondary, mu).other_focus_height
    gain_secondary = 1 / mu
    # Seen from its viewpoint the primary's vertex is p1 away, which is kappa times as far as from the shared focus.
    gain_primary = p_primary / (shared_focus - vertex_primary)
    assert is_zero(sp.limit(sp.cancel(gain_primary * gain_secondary), mu, 0) - p_primary / p_secondary)
    assert sp.limit(1 / shared_focus, mu, 0) == 0


# (primary, secondary), and the sign of c of both: ellipsoids may share a focus that the light never reaches.
FOLDED_PAIRS = [
    (KINDS[primary], KINDS[secondary].subs(p, p_other), 1)
    for primary, secondary in product(KINDS, KINDS)
    if (primary, secondary) != ("plane", "plane")
]
FOLDED_PAIRS.append((1 + p, -(1 + p_other), -1))


@pytest.mark.parametrize(("q_primary", "q_secondary", "side"), FOLDED_PAIRS)
def test_gains_of_a_folded_pair_multiply(q_primary: sp.Expr, q_secondary: sp.Expr, side: int):
    """From a world direction of half-tangent t at the viewpoint, over both conics, to the pinhole."""
    c_secondary, c_primary = side * c, side * c * sp.symbols("ratio", positive=True)
    shared_focus = 2 * c_secondary
    viewpoint = shared_focus - 2 * c_primary
    t_shared = gain(q_primary) * t
    cosine, sine = (1 - t_shared**2) / (1 + t_shared**2), 2 * t_shared / (1 + t_shared**2)
    # The primary faces up: its polar form about the shared focus points down.
    rho = c_primary * (1 - q_primary**2) / (cosine - q_primary)
    assert is_zero((shared_focus - rho * cosine - viewpoint) / (rho * sine) - SLOPE_FOLDED)
    # The ray on from there through the shared focus meets the secondary where a ray of the pinhole does.
    radius, height, _ = (part.subs(c, c_secondary) for part in polar_point(q_secondary))
    radius, height = (part.subs(t_a, gain(q_secondary) * t_shared) for part in (radius, height))
    assert is_zero((height - shared_focus) * sine + radius * cosine)
    assert is_zero(f * radius / height - law(gain(q_secondary) * gain(q_primary), t))


# The view, as the program computes it


@pytest.mark.parametrize(("sense", "slope"), [("direct", SLOPE_DIRECT), ("folded", SLOPE_FOLDED)])
def test_view_module_is_the_gain_law(monkeypatch, sense, slope):
    monkeypatch.setattr(view, "sqrt", square_root)
    assert is_zero(view.half_angle_tangent(slope, sense) - t)
    assert is_zero(view.elevation_tangent(t, sense) - slope)
    assert is_zero(view.image_radius(slope, kappa, f, sense) - law(kappa, t))
    # tan(psi/2) = 1 / (1 + p) < 1: below 90 degrees at the pinhole.
    assert is_zero(view.image_half_tangent(law(sp.Integer(1), 1 / (1 + p)), f) - 1 / (1 + p))


@pytest.mark.parametrize(("sense", "sign"), [("direct", 1), ("folded", -1)])
def test_derivative_of_the_image_radius(monkeypatch, sense, sign):
    monkeypatch.setattr(view, "sqrt", square_root)
    slope = SLOPE_DIRECT if sense == "direct" else SLOPE_FOLDED
    # dt/dphi of t = tan(pi/4 +- phi/2).
    half_angle = sp.pi / 4 + sign * phi / 2
    assert sp.simplify(sp.diff(sp.tan(half_angle), phi) - sign * (1 + sp.tan(half_angle) ** 2) / 2) == 0
    by_chain_rule = sp.diff(law(kappa, t), t) * sign * (1 + t**2) / 2
    tangent_psi = law(kappa, t) / f
    design_notes = sign * f * (1 + tangent_psi**2) * kappa * (1 + t**2) / (1 + kappa**2 * t**2)
    assert is_zero(by_chain_rule - design_notes)
    assert is_zero(by_chain_rule - view.image_radius_slope(slope, kappa, f, sense))


# One conic by vertex distance and inverse gain, as the optimiser has it


def test_conic_by_vertex_distance_and_tangent_ratio():
    vertex_distance, tangent_ratio = c * (1 + q), (1 + q) / (1 - q)
    conic = FocalConic(sp.Integer(0), vertex_distance, tangent_ratio)
    radius, height, _ = polar_point(q)
    assert is_zero(conic.point(t_a)[0] - radius)
    assert is_zero(conic.point(t_a)[1] - height)
    assert is_zero(conic.surface.vertex_height - c * (1 + q))
    assert is_zero(conic.surface.curvature - q / (c * (1 - q**2)))
    assert is_zero(conic_constant(tangent_ratio) + 1 / q**2)
    assert is_zero(conic.surface.conic_term - (1 - 1 / q**2) * conic.surface.curvature**2)
    assert is_zero(conic.other_focus_height - 2 * c)
    assert is_zero(conic.surface.curvature - (tangent_ratio - 1) / (2 * vertex_distance))
    assert is_zero(conic.surface.conic_term + tangent_ratio / vertex_distance**2)


def test_vertex_equation_holds_for_every_tangent_ratio():
    """Also for mu = 0 and mu = 1, paraboloid and plane, without a limit."""
    vertex_distance = sp.symbols("v", real=True, nonzero=True)
    conic = FocalConic(sp.Integer(0), vertex_distance, mu)
    radius, height = conic.point(t)
    sag = height - vertex_distance
    curvature, term = conic.surface.curvature, conic.surface.conic_term
    assert is_zero(curvature * radius**2 - 2 * sag + term / curvature * sag**2)
    assert is_zero((conic.surface.conic_term * radius**2 - 1) + ((1 + mu * t**2) / (1 - mu * t**2)) ** 2)
    # The vertex sheet: z = v + C R^2 / (1 + sqrt(1 - (1+K) C^2 R^2)), the root being (1 + mu t^2) / (1 - mu t^2).
    root = (1 + mu * t**2) / (1 - mu * t**2)
    assert is_zero(sag - curvature * radius**2 / (1 + root))


def test_conic_seen_from_its_other_focus():
    """From focus B: the same formulas, upside down, with kappa for mu and v kappa for v."""
    vertex_distance, t_b = sp.symbols("v t_b", real=True, nonzero=True)
    from_a = FocalConic(sp.Integer(0), vertex_distance, 1 / kappa)
    from_b = FocalConic(from_a.other_focus_height, -vertex_distance * kappa, kappa)
    assert is_zero(from_a.surface.vertex_height - from_b.surface.vertex_height)
    assert is_zero(from_a.surface.curvature - from_b.surface.curvature)
    assert is_zero(from_a.surface.conic_term - from_b.surface.conic_term)
    assert is_zero(from_b.other_focus_height)
    radius_a, height_a = from_a.point(kappa * t_b)
    # Its half-tangent is taken from B->A, so up is down and R keeps the sign of the side that t_b gives it.
    width = vertex_distance * kappa
    assert is_zero(radius_a - 2 * width * t_b / (1 - kappa * t_b**2))
    assert is_zero(from_a.other_focus_height - height_a - width * (1 - t_b**2) / (1 - kappa * t_b**2))


# Depth


def test_depth_by_intersection_of_the_two_rays():
    height_lower, slope_lower, slope_upper, distance, b = sp.symbols("z_l m_l m_u D b", real=True)
    meeting = sp.Eq(height_lower + distance * slope_lower, height_lower + b + distance * slope_upper)
    (solution,) = sp.solve(meeting, distance)
    assert is_zero(solution - b / (slope_lower - slope_upper))


@pytest.mark.parametrize("sense_lower", ["direct", "folded"])
def test_depth_error_is_the_propagated_noise(monkeypatch, sense_lower):
    """Differentiate D by the two image radii, through the inverse of the gain law, and compare with the program."""
    monkeypatch.setattr(view, "sqrt", square_root)
    monkeypatch.setattr(depth, "sqrt", lambda value: value)
    t_l, t_u, kappa_l, kappa_u, b, noise = sp.symbols("t_l t_u kappa_l kappa_u b sigma", positive=True)
    base = SLOPE_DIRECT if sense_lower == "direct" else SLOPE_FOLDED
    slope_lower, slope_upper = base.subs(t, t_l), SLOPE_DIRECT.subs(t, t_u)
    distance = b / (slope_lower - slope_upper)
    by_radius_lower = sp.diff(distance, t_l) / sp.diff(law(kappa_l, t_l), t_l)
    by_radius_upper = sp.diff(distance, t_u) / sp.diff(law(kappa_u, t_u), t_u)
    variance = noise**2 * (by_radius_lower**2 + by_radius_upper**2)
    # With the square root taken away the function returns D/b times the sum of the squared slope errors.
    pair = depth.StereoPair(kappa_l, sense_lower, kappa_u, "direct", b, f)
    root_free = depth.depth_error_of_slopes(pair, PerView(lower=slope_lower, upper=slope_upper), noise)
    assert is_zero(variance / distance**2 - root_free * distance / b)
    # The form of docs/theory.md, section 5: sigma_D = (D^2/b) sqrt((sigma_l sec^2 phi_l)^2 + (sigma_u sec^2 phi_u)^2).
    sigma = [
        noise / view.image_radius_slope(slope, gain_value, f, sense) * (1 + slope**2)
        for slope, gain_value, sense in ((slope_lower, kappa_l, sense_lower), (slope_upper, kappa_u, "direct"))
    ]
    assert is_zero(variance - (distance**2 / b) ** 2 * (sigma[0] ** 2 + sigma[1] ** 2))
