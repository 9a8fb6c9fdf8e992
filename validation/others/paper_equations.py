"""The paper's equations (2) to (9) in thirty digits, as restored: python -m validation.others.paper_equations."""

import mpmath as mp

mp.mp.dps = 30
F, SLOPE = mp.mpf(12), mp.mpf("0.25")


def hyperboloid(a: int, c: int, m: mp.mpf) -> mp.mpf:
    b2 = mp.mpf(c) ** 2 - mp.mpf(a) ** 2
    radius = b2 * (m * c + a * mp.sqrt(1 + m**2)) / (a**2 - m**2 * b2)
    return F * radius / (m * radius + 2 * c)


def ellipsoid(a: int, c: int, m: mp.mpf) -> mp.mpf:
    b2 = mp.mpf(a) ** 2 - mp.mpf(c) ** 2
    radius = -b2 * (m * c + a * mp.sqrt(1 + m**2)) / (a**2 + m**2 * b2)
    return F * radius / (m * radius + 2 * c)


def paraboloids(p1: int, p2: int, m: mp.mpf) -> mp.mpf:
    radius = 2 * p1 * (mp.sqrt(1 + m**2) - m)
    return F * radius / (-(radius**2) / (4 * p2) + p2)


print("mpmath", mp.__version__)
print("hyperboloid", mp.nstr(hyperboloid(48, 60, SLOPE), 16))
print("ellipsoid", mp.nstr(ellipsoid(80, 60, SLOPE), 16))
print("paraboloids", mp.nstr(paraboloids(6, 110, SLOPE), 16))
