"""What docs/contributing.md promises: a constraint is one entry in one table, and works everywhere.

It is added here as a contributor would add it, and nothing else is touched.
"""

import numpy as np
import pytest

from designer.optics.backend import arctan, degrees, sqrt
from designer.optimise import constraints
from designer.optimise.constraints import Constraint
from designer.optimise.program import forget_programs
from designer.study.task import solve_configuration
from designer.trace.aiming import meridional_rays
from support.shipped_problems import CONFIGURATIONS, shipped_requirement

DIRECT, FOLDED = "direct-HyHy-upper_inner", "folded-HyPl-Hy-upper_outer"


def incidence_limit(largest_deg):
    """The recipe's constraint: at both ends of each zone no mirror is met at a larger angle from its normal."""

    def incidence(system):
        for path in system.paths:
            for reflection in path.reflections:
                conic, surface = reflection.conic, reflection.conic.surface
                for tangent in reflection.half_tangents:
                    radius, height = conic.point(tangent)
                    slope = surface.curvature * radius / sqrt(1.0 - surface.conic_term * radius**2)
                    # Ray (R, z - z_F) against the normal (-slope, 1), as the tangent of the angle between them.
                    along, across = height - conic.focus_height, radius
                    angle = arctan(sqrt(((along * slope + across) / (along - slope * across)) ** 2 + 1e-18))
                    name = f"angle of incidence on the {reflection.mirror} mirror"
                    yield Constraint("incidence", name, "deg", 1.0, largest_deg - degrees(angle))

    return incidence


def traced_incidences_deg(design):
    """Angles of incidence at the ends of both views' ranges, by the ray tracer."""
    angles = []
    for name in ("lower", "upper"):
        for line in meridional_rays(design, name, getattr(design.views, name).elevation_deg, length_mm=10.0):
            steps = np.diff(line, axis=0)
            ahead = steps / np.linalg.norm(steps, axis=1, keepdims=True)
            angles += np.degrees(np.arccos(-np.sum(ahead[:-1] * ahead[1:], axis=1)) / 2.0).tolist()
    return angles


@pytest.fixture(autouse=True)
def _fresh_programs():
    """Programs remember the tables they were built from."""
    forget_programs()
    yield
    forget_programs()


def study(requirement, *names):
    results = [solve_configuration(requirement, CONFIGURATIONS[name]) for name in names]
    assert all(result.status == "feasible" for result in results), [result.row.reason for result in results]
    return results


@pytest.mark.parametrize("name", [DIRECT, FOLDED])
def test_a_constraint_is_one_function_in_the_table(name, monkeypatch):
    """Without it light meets mirrors at up to 58 or 60 degrees from the normal; with it, at no more than it allows."""
    asked = shipped_requirement("indoor_robot")
    (plain,) = study(asked, name)
    assert max(traced_incidences_deg(plain.design)) > 58.0
    forget_programs()
    monkeypatch.setattr(constraints, "CONSTRAINTS", (*constraints.CONSTRAINTS, incidence_limit(57.5)))
    (limited,) = study(asked, name)
    assert max(traced_incidences_deg(limited.design)) <= 57.5 + 1e-4
    assert limited.first.goals["depth_error"] >= plain.first.goals["depth_error"] * (1.0 - 1e-6)


def test_a_constraint_that_cannot_be_kept_is_named(monkeypatch):
    monkeypatch.setattr(constraints, "CONSTRAINTS", (*constraints.CONSTRAINTS, incidence_limit(10.0)))
    result = solve_configuration(shipped_requirement("indoor_robot"), CONFIGURATIONS[FOLDED])
    assert result.status == "infeasible"
    assert "angle of incidence on the" in result.row.reason
    assert " deg" in result.row.reason
