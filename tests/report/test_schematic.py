"""The rays of the schematics, traced, pass through the foci that the conics were made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.report.figures.schematic import (
    Principle,
    conic_between,
    hyperboloid_or_ellipsoid,
    paraboloid_pair,
    rays,
)

PRINCIPLES = {
    "hyperboloid": (hyperboloid_or_ellipsoid("", 50.0, 0.6, (8.0, 26.0)), 0.25),
    "ellipsoid": (hyperboloid_or_ellipsoid("", 30.0, 1.6, (8.0, 19.0)), -0.6 / 2.6),
    "paraboloids": (paraboloid_pair("", 20.0, 6.0, 90.0, (4.0, 11.0)), 6.0 / 90.0),
    "two conics": (
        Principle(
            "",
            (conic_between(0.0, 150.0, 0.2, 1), conic_between(150.0, 15.0, 0.85, -1)),
            {"P": 0.0, "F": 15.0},
            (3.5, 9.0),
        ),
        (0.8 / 1.2) * (0.15 / 1.85),
    ),
}


@pytest.mark.parametrize("name", PRINCIPLES)
def test_rays_leave_through_the_viewpoint_by_the_gain_law(name: str) -> None:
    principle, gain = PRINCIPLES[name]
    viewpoint = list(principle.foci.values())[-1]
    psi_deg = np.linspace(*principle.psi_deg, 5)
    for psi, (*_, last, ahead) in zip(np.radians(psi_deg), rays(replace(principle, psi_deg=psi_deg)), strict=True):
        back = viewpoint - last[1] + ahead[1] / ahead[0] * last[0]
        assert abs(back) < 1e-9
        # Signed elevation: negative gain sends the ray to the other side of the axis.
        side = 1.0 if gain > 0 else -1.0
        elevation = np.arctan2(ahead[1], side * ahead[0])
        sense = 1.0 if len(principle.mirrors) == 1 else -1.0
        expected = abs(gain) * np.tan(np.pi / 4 + sense * elevation / 2)
        assert np.tan(psi / 2) == pytest.approx(expected, rel=1e-12)


def test_a_ray_that_misses_says_so() -> None:
    with pytest.raises(ValueError, match="misses"):
        rays(Principle("", (conic_between(0.0, 100.0, 0.6, 1),), {}, (85.0,)))
