"""Where a mirror that is no single-viewpoint mirror images a point: python -m validation.others.forward_projection.

Thirty digits. The sphere by Alhazen's quartic; the conic off its focus by the polynomial of Agrawal, Taguchi and
Ramalingam (2011) for an axial quadric. Both give the tangent of the angle at the pinhole, in the meridian of the point.
"""

import mpmath as mp
import sympy as sp

mp.mp.dps = 40


def sphere(radius: int, vertex: int, distance: int, height: int) -> mp.mpf:
    """The mirror bulges down, its centre a radius above its vertex; source in the origin."""
    centre = mp.mpf(vertex + radius)
    a, b = mp.mpc(0, -centre / radius), mp.mpc(mp.mpf(distance) / radius, (height - centre) / radius)
    roots = mp.polyroots([mp.conj(a * b), -mp.conj(a + b), 0, a + b, -a * b], maxsteps=500, extraprec=200)
    places = [z for z in roots if abs(abs(z) - 1) < mp.mpf("1e-20")]
    place = min(places, key=lambda z: abs(z - a) + abs(z - b))
    return radius * place.real / (centre + radius * place.imag)


def conic(radius: int, conic_constant: str, vertex: int, distance: int, height: int) -> mp.mpf:
    """z from the vertex in units of the radius, x^2 + k z^2 = 2 z, k = 1 + K."""
    z, x = sp.symbols("z x")
    k = 1 + sp.Rational(conic_constant)
    source, target = sp.Rational(vertex, radius), sp.Rational(height - vertex, radius)
    into, normal, out = (x, z + source), (x, k * z - 1), (sp.Rational(distance, radius) - x, target - z)

    def cross(u, v):
        return u[0] * v[1] - u[1] * v[0]

    def dot(u, v):
        return u[0] * v[0] + u[1] * v[1]

    law = sp.expand(cross(into, normal) * dot(out, normal) + cross(out, normal) * dot(into, normal))
    law = sp.rem(sp.Poly(law, x), sp.Poly(x**2 - 2 * z + k * z**2, x))
    odd, even = law.coeff_monomial(x), law.coeff_monomial(1)
    polynomial = sp.Poly(sp.expand(even**2 - (2 * z - k * z**2) * odd**2), z)
    roots = mp.polyroots([mp.mpf(c.p) / c.q for c in polynomial.all_coeffs()], maxsteps=2000, extraprec=400)

    def length(root):
        across = mp.sqrt(2 * root - (1 + mp.mpf(conic_constant)) * root**2)
        first = mp.hypot(across, root + mp.mpf(vertex) / radius)
        return first + mp.hypot(mp.mpf(distance) / radius - across, mp.mpf(height - vertex) / radius - root), across

    found = []
    for root in roots:
        if abs(root.imag) < mp.mpf("1e-20") and root.real > 0:
            value = root.real
            across = length(value)[1]
            terms = [sp.N(term.subs(z, sp.Float(str(value), 40)), 40) for term in (even, odd)]
            residual = mp.mpf(str(terms[0])) + across * mp.mpf(str(terms[1]))
            if isinstance(across, mp.mpf) and abs(residual) < mp.mpf("1e-15"):
                found.append(value)
    # A convex mirror reflects on its side towards the light: the shortest of the stationary paths.
    root = min(found, key=lambda value: length(value)[0])
    return length(root)[1] / (root + mp.mpf(vertex) / radius)


print("mpmath", mp.__version__, "SymPy", sp.__version__)
print("sphere", mp.nstr(sphere(30, 100, 1000, 250), 16))
print("conic", mp.nstr(conic(30, "-2.3", 100, 1000, 250), 16))
