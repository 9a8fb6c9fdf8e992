"""Overall height and diameter against points on every face and back, and against the judge's own reckoning."""

from __future__ import annotations

import json

import casadi
import numpy as np
import pytest

from designer.design import Design
from designer.optics.conic import Surface
from designer.optics.overall_size import Substrate, overall_size
from designer.trace.instrument import sag
from support import DATA

DESIGNS = [Design.model_validate(record) for record in json.loads((DATA / "studied_designs.json").read_text("utf-8"))]


def substrates_of(design: Design) -> list[Substrate]:
    return [
        Substrate(
            Surface(mirror.vertex_mm, curvature, (1.0 + mirror.conic) * curvature**2),
            mirror.inner_radius_mm,
            mirror.outer_radius_mm,
            mirror.back_offset_mm,
        )
        for mirror in design.mirrors
        for curvature in [0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm]
    ]


def points_of(design: Design) -> np.ndarray:
    """Points (n, 2) all over the faces and backs of a design, as the tracer has them."""
    points = []
    for mirror in design.mirrors:
        radii = np.linspace(mirror.inner_radius_mm, mirror.outer_radius_mm, 501)
        face = mirror.vertex_mm + sag(mirror, radii)
        points += [np.column_stack([radii, face]), np.column_stack([radii, face + mirror.back_offset_mm])]
    return np.concatenate(points)


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_no_point_of_a_studied_design_reaches_beyond_and_some_reach_its_size(design):
    size = overall_size(substrates_of(design), design.camera.lens_front_mm)
    points = points_of(design)
    lowest = min(float(points[:, 1].min()), design.camera.lens_front_mm)
    assert (size.bottom, size.top) == pytest.approx((lowest, float(points[:, 1].max())), abs=1e-9)
    assert size.height == pytest.approx(design.height_mm, abs=1e-6)
    assert size.diameter == pytest.approx(design.diameter_mm, abs=1e-9)


def test_the_lens_front_counts_as_the_lowest_point_and_never_as_the_highest():
    plate = [Substrate(Surface(50.0, 0.0, 0.0), 0.0, 20.0, 3.0)]
    assert overall_size(plate, 4.0).height == 49.0
    assert overall_size(plate, 90.0).height == 3.0
    assert overall_size(plate, 4.0).diameter == 40.0


def test_symbols_give_what_numbers_give():
    radius = casadi.SX.sym("radius")
    bowl = Substrate(Surface(60.0, -0.01, 1e-4), 5.0, radius, -2.0)
    plate = Substrate(Surface(20.0, 0.0, 0.0), 0.0, 25.0, 4.0)
    size = overall_size([plate, bowl], 3.0)
    function = casadi.Function("size", [radius], [size.top, size.bottom, size.radius])
    for value in (10.0, 30.0):
        expected = overall_size([plate, Substrate(bowl.face, 5.0, value, -2.0)], 3.0)
        found = [float(number) for number in function(value)]
        assert found == pytest.approx([expected.top, expected.bottom, expected.radius], rel=1e-14)
