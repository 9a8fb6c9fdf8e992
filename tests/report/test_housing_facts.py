"""What a page says of a housing, and that the requirement's table and the drawing have it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from designer.report.content.housing import housing_groups
from designer.report.content.requirement import requirement_groups
from designer.report.figures.cross_section import WALL, draw_cross_section
from designer.requirement import set_key
from support.housings import with_struts, with_tube
from support.shipped_problems import shipped_requirement
from support.studied_designs import SHARP_NAMES, sharp_design

DESIGN = sharp_design(SHARP_NAMES[2])


def test_a_tube_is_described_by_its_sizes_and_what_it_does():
    design = with_tube(DESIGN)
    ((title, facts),) = housing_groups(design)
    said = dict(facts)
    assert title == "Housing"
    outer, inner = 2.0 * design.tube.outer_radius_mm, 2.0 * design.tube.inner_radius_mm
    assert said["tube"] == f"⌀{outer:.1f}/{inner:.1f}, {design.tube.length_mm:.1f} mm long"
    # By hand, from the plate's angles at the steepest ray and the flattest.
    steep, flat = (np.radians(end) for end in design.views.lower.elevation_deg[::-1])
    shifts = [3.0 * (np.tan(angle) - np.tan(np.arcsin(np.sin(angle) / 1.49))) for angle in (steep, flat)]
    assert said["rays move axially by"] == f"−{shifts[0]:.2f} to {shifts[0]:.2f} mm"
    smear = shifts[0] - shifts[1]
    assert said["viewpoints smeared"] == f"{smear:.2f}, {smear:.2f} mm (upper, lower)"
    assert "uncorrected" in said["bias at 120 mm"]
    assert "upper" in said["far side reflected at"]


def test_struts_say_what_they_hide():
    ((_, facts),) = housing_groups(with_struts(DESIGN, number=4, width_mm=6.0))
    said = dict(facts)
    assert said["at azimuths"] == "0°, 90°, 180°, 270°"
    radius = DESIGN.diameter_mm / 2.0 + 4.0
    share = 100.0 * 4.0 * 2.0 * np.degrees(np.arcsin(3.0 / radius)) / 360.0
    assert said["hidden azimuths"].endswith(f"{share:.1f} % of all")


def test_a_design_without_a_housing_has_no_group_and_its_requirement_neither():
    assert housing_groups(DESIGN) == []
    plain = shipped_requirement("pipe_inspection")
    assert "Housing" not in dict(requirement_groups(plain))
    asked = dict(requirement_groups(set_key(plain, "housing", {"kind": "struts", "number": 5})))
    assert dict(asked["Housing"])["struts"] == "5"
    assert "wall of the tube" not in dict(asked["Housing"])


def test_the_walls_are_drawn_where_they_stand():
    design = with_tube(DESIGN)
    drawing = draw_cross_section(design, 160.0, 110.0)
    (axes,) = drawing.figure.axes
    walls = [patch for patch in axes.patches if patch.get_facecolor()[:3] == plt.matplotlib.colors.to_rgb(WALL)]
    edges = sorted({round(float(abs(x)), 9) for wall in walls for x in wall.get_xy()[:, 0]})
    np.testing.assert_allclose(edges, [design.tube.inner_radius_mm, design.tube.outer_radius_mm])
    assert len(walls) == 2
    plt.close(drawing.figure)
