"""What the judge says of a tube or struts: touching, too short, too narrow; and nothing of one that fits."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import Design
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from designer.verify.judge import judge
from support.housings import with_struts, with_tube
from support.imaging_designs import prototype
from support.studied_designs import SHARP_NAMES, sharp_design


def problems_of(design: Design, **changes: float) -> list[str]:
    """What the judge says of a design whose housing is changed."""
    housing = design.housing.model_copy(update=changes)
    return [
        said for said in judge(design.model_copy(update={"housing": housing})).problems if "diameter_mm" not in said
    ]


@pytest.mark.parametrize("name", SHARP_NAMES[::4])
def test_a_housing_that_fits_changes_nothing(name):
    design = sharp_design(name)
    for housed in (with_tube(design), with_struts(design)):
        assert judge(housed, whole_image=False).problems == judge(design, whole_image=False).problems


def test_a_tube_that_touches_is_refused():
    design = with_tube(prototype())
    widest = max(design.mirrors, key=lambda mirror: mirror.outer_radius_mm)
    said = problems_of(design, inner_radius_mm=widest.outer_radius_mm)
    assert any(f"the tube and {widest.name} touch" in each for each in said)
    said = problems_of(design, inner_radius_mm=widest.outer_radius_mm - 1.0)
    assert any(f"the tube and {widest.name} penetrate" in each for each in said)
    # Below the mirror, and so narrow that its light would have to come in from outside.
    lowest = widest.vertex_mm - 50.0
    said = problems_of(design, inner_radius_mm=widest.outer_radius_mm - 1.0, low_mm=lowest - 2.0, high_mm=lowest)
    assert any(f"{widest.name} reaches to radius" in each for each in said)


def test_struts_in_the_camera_are_refused():
    said = problems_of(with_struts(prototype()), low_mm=-90.0, radius_mm=21.0)
    assert any("struts and camera body penetrate" in each for each in said)


def test_light_past_the_ends_of_a_tube_is_refused_by_as_much_as_is_missing():
    """Traced here by the gain law's angle for the lowest ray, and cut two millimetres above it."""
    design = with_tube(prototype())
    view, tube = design.views.upper, design.tube
    lowest = np.radians(view.elevation_deg[0])
    psi = 2.0 * np.arctan(view.gain * np.tan(np.pi / 4.0 + lowest / 2.0))
    instrument = build_instrument(design)
    trace = trace_sequential(instrument, instrument.path(view.path), pinhole_directions([psi]), apertures=False)
    slope = np.tan(lowest)
    at_inner = view.viewpoint_mm + slope * tube.inner_radius_mm
    assert trace.hits[-1][0, 2] == pytest.approx(view.viewpoint_mm + slope * trace.hits[-1][0, 0])
    inside = np.tan(np.arcsin(np.sin(lowest) / tube.refractive_index))
    at_outer = at_inner + inside * tube.wall_mm
    said = problems_of(design, low_mm=at_outer + 2.0)
    assert "upper view: the required rays pass 2 mm below the lower end of the tube" in said


def test_the_size_counts_the_tube():
    design = with_tube(prototype())
    assert not [said for said in judge(design).problems if "_mm is" in said]
    said = judge(design.model_copy(update={"diameter_mm": prototype().diameter_mm})).problems
    assert any("the mirrors and the housing are" in each for each in said)
