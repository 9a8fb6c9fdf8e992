"""What docs/contributing.md promises: a goal, a constraint, a key or a format is one entry in one place.

They are added here as a contributor would add them, nothing else is touched, and they work everywhere.
"""

import csv
import io
import json
import os
import subprocess
import sys
from typing import Annotated

import numpy as np
import pytest
from click.testing import CliRunner
from pydantic import Field

from designer.cli import cli
from designer.export.formats import EXPORTS, ExportFormat
from designer.files import InputError
from designer.goals import GOALS
from designer.optics.backend import arctan, degrees, sqrt
from designer.optimise import constraints
from designer.optimise.constraints import Constraint
from designer.optimise.program import forget_programs
from designer.report.content.requirement import requirement_groups
from designer.requirement.quantity import Quantity
from designer.requirement.space import Envelope
from designer.study.task import solve_configuration
from designer.trace.aiming import meridional_rays
from support import DATA, ROOT, bounded_key
from support.shipped_problems import CONFIGURATIONS, shipped_requirement, with_thin_light

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
    asked = with_thin_light(shipped_requirement("indoor_robot"))
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


@pytest.fixture(scope="module")
def studies_of_mass():
    """Two configurations studied for the least mass and for the least depth error, in processes that know the goal."""
    return {
        first: json.loads(
            subprocess.run(
                [
                    sys.executable,
                    "-m",
                    "support.mass_goal",
                    json.dumps({"minimise": first, "then": then}),
                    *(DIRECT, FOLDED),
                ],
                cwd=ROOT / "tests",
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for first, then in (("mass", "depth_error"), ("depth_error", "mass"))
    }


def test_a_goal_is_one_entry_in_the_table(studies_of_mass):
    """It is minimised, recorded, tabled, ranked by and named, and its value is the workshop's own number."""
    assert "mass" not in GOALS
    least = {}
    for first, study_of_one in studies_of_mass.items():
        rows = list(csv.DictReader(io.StringIO(study_of_one["table"])))
        assert [row["status"] for row in rows] == ["feasible"] * 2
        for row in rows:
            name = row["configuration"]
            assert float(row["mass_g"]) == pytest.approx(study_of_one["masses_g"][name], rel=1e-6)
            assert study_of_one["scores"][name]["second_stage"]["mass_g"] == float(row["mass_g"])
            least[first, name] = float(row["first_stage_mass_g"])
        page = study_of_one["page"]
        assert "mass_g" in page["goals"]
        assert page["columns"]["mass_g"]["label"] == "mass"
        masses = [float(row["mass_g"]) for row in rows]
        assert [row["mass_g"] for row in page["rows"]] == pytest.approx(masses, rel=1e-8)
        column = {"mass": "first_stage_mass_g", "depth_error": "first_stage_depth_error_rms"}[first]
        assert float(rows[0][column]) <= 1.01 * min(float(row[column]) for row in rows)
    for name in (DIRECT, FOLDED):
        assert least["mass", name] < 0.8 * least["depth_error", name]
    assert " tied within 1 % in mass" in studies_of_mass["mass"]["verdict"].replace(" with it", "")


def test_what_comes_second_is_the_least_mass_that_the_first_allows(studies_of_mass):
    """Within 1 % of the least depth error the mirrors get lighter, never heavier."""
    for row in csv.DictReader(io.StringIO(studies_of_mass["depth_error"]["table"])):
        assert float(row["mass_g"]) <= float(row["first_stage_mass_g"]) * (1.0 + 1e-6)
        assert float(row["depth_error_rms"]) <= 1.01 * float(row["first_stage_depth_error_rms"]) * (1.0 + 1e-6)


def test_a_key_of_the_requirement_with_a_title_shows_itself_in_the_report():
    class Roomy(Envelope):
        cable_deg: Annotated[float, Quantity(0, 90, "degrees"), Field(title="cable leaves at", default=30.0)]

    asked = shipped_requirement("indoor_robot")
    roomy = asked.model_copy(update={"envelope": Roomy(**asked.envelope.model_dump())})
    before, after = dict(requirement_groups(asked)), dict(requirement_groups(roomy))
    assert after["Envelope"] == [*before["Envelope"], ("cable leaves at", "30°")]


def test_a_bound_is_one_field_and_one_constraint(tmp_path):
    """In a copy with the page's two snippets a design is held by the new key, and its multiplier is reported."""
    assert bounded_key.copy_with_key(tmp_path) == ["optimise/constraints.py", "requirement/space.py"]
    run = [sys.executable, "-m", "support.bounded_key"]
    paths = {"PYTHONPATH": f"{tmp_path}:{ROOT / 'tests'}"}
    found = json.loads(
        subprocess.run(run, cwd=tmp_path, env=os.environ | paths, check=True, capture_output=True).stdout
    )
    assert found["viewpoint_mm"] == pytest.approx(found["least_mm"], abs=1e-5)
    assert found["unbound_multiplier"] == pytest.approx(0.0, abs=1e-9)
    assert found["multiplier"] > 1e-6
    assert found["multiplier"] == pytest.approx(found["finite_difference"], rel=1e-3)
    assert ["lower viewpoint, at least", f"{found['least_mm']:g} mm"] in found["facts"]
    assert "envelope.lowest_viewpoint_mm = 5000.0: must be a number from -1000 to 1000 (mm)" in found["refused"]


def test_an_export_format_is_one_entry_in_the_table(tmp_path, monkeypatch):
    """A list of blanks for the saw: the command writes it, and refuses what it cannot hold, with the reason."""

    def blanks(design):
        if any(mirror.thickness_mm == 0.0 for mirror in design.mirrors):
            raise InputError("a blank without thickness cannot be sawn")
        rows = [f"{2.0 * mirror.outer_radius_mm:.2f} {mirror.thickness_mm:.2f}" for mirror in design.mirrors]
        return {design.configuration: "\n".join(["diameter_mm thickness_mm", *rows]) + "\n"}

    entry = ExportFormat("blanks to saw", ".txt", "design", blanks, leaves_out="the faces")
    monkeypatch.setitem(EXPORTS, "blanks", entry)
    design, out = DATA / "folded_hypl_hy.json", tmp_path / "blanks.txt"
    result = CliRunner().invoke(cli, ["export", str(design), "--to", "blanks", "-o", str(out)])
    assert result.stdout.splitlines() == [f"{out} written", "not in this format: the faces"]
    assert out.read_text().splitlines()[1] == "17.12 2.00"
    record = json.loads(design.read_text())
    record["mirrors"][0]["thickness_mm"] = 0.0
    thin, absent = tmp_path / "thin.json", tmp_path / "absent.txt"
    thin.write_text(json.dumps(record))
    refused = CliRunner().invoke(cli, ["export", str(thin), "--to", "blanks", "-o", str(absent)])
    assert (refused.exit_code, refused.stderr) == (2, f"designer: {thin}: a blank without thickness cannot be sawn\n")
    assert not absent.exists()
