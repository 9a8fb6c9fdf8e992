"""What a tube does to depth, viewpoints and blur: closed forms against rays traced through mirrors and wall."""

from __future__ import annotations

import json

import numpy as np
import pytest

from designer.design import VIEW_NAMES, Design, PerView
from designer.evaluate.depth import depth_error_map, noise_mm_of, stereo_pair_of
from designer.evaluate.housing import ELEVATIONS, blurs_mm, housing_mass_g, housing_score
from designer.evaluate.score import evaluate_design
from designer.imaging.stereo.reconstruction import triangulate
from designer.optics.focus import lens_of_camera
from designer.trace.aiming import exit_lines, project
from designer.trace.housing import refract
from designer.trace.instrument import build_instrument
from designer.trace.pencils import chief_rays
from designer.trace.sequential import trace_sequential
from support.housings import with_struts, with_tube
from support.studied_designs import SHARP_NAMES, sharp_design

PIPE = next(name for name in SHARP_NAMES if name.startswith("pipe_inspection"))


@pytest.mark.parametrize("name", [PIPE, SHARP_NAMES[0]])
def test_the_uncorrected_bias_is_that_of_traced_points(name):
    """Points traced through the tube into both images, then read by the plain design's own triangulation."""
    design = with_tube(sharp_design(name))
    plain = design.model_copy(update={"housing": None})
    score = housing_score(design)
    low, high = np.radians(design.working_volume.elevation_deg)
    elevations = np.linspace(low, high, ELEVATIONS)
    for predicted in score.uncorrected_bias:
        distances = np.full(ELEVATIONS, predicted.distance_mm)
        heights = design.views.middle_mm + distances * np.tan(elevations)
        slopes = {}
        for view in VIEW_NAMES:
            instrument = build_instrument(plain)
            path = instrument.path(plain.views.by_name[view].path)
            _, ahead = exit_lines(instrument, path, project(design, view, distances, heights))
            slopes[view] = ahead[1] / np.abs(ahead[0])
        found, _ = triangulate(PerView(**slopes), 0.0, design.baseline_mm)
        bias = found - predicted.distance_mm
        assert predicted.bias_mm == pytest.approx(bias[np.argmax(np.abs(bias))], rel=1e-5)
        errors = depth_error_map(
            stereo_pair_of(design), elevations, distances, noise_mm_of(design), design.scale_uncertainty
        )
        in_sigma = bias / (errors * distances)
        assert predicted.bias_in_sigma == pytest.approx(in_sigma[np.argmax(np.abs(in_sigma))], rel=1e-4)


def test_the_viewpoint_is_smeared_over_where_traced_lines_cross_the_axis():
    design = with_tube(sharp_design(PIPE))
    score = housing_score(design)
    instrument = build_instrument(design)
    for name, view in design.views.by_name.items():
        chief = chief_rays(
            instrument, instrument.path(view.path), np.linspace(*view.elevation_deg, ELEVATIONS), np.pi / 3.0
        )
        through = refract(design.tube, chief.point, chief.direction)
        radial = through.direction[:, 0] * through.at_outer[:, 0]
        crossing = through.at_outer[:, 2] - through.direction[:, 2] * through.at_outer[:, 0] ** 2 / radial
        assert np.ptp(crossing) == pytest.approx(score.smear_mm[name], abs=1e-9)
        shifts = crossing - view.viewpoint_mm
        np.testing.assert_allclose(score.shift_mm[name], (shifts.min(), shifts.max()), atol=1e-9)


@pytest.mark.parametrize("name", [PIPE, SHARP_NAMES[0], SHARP_NAMES[10]])
def test_the_blur_through_the_wall_is_that_of_traced_pencils(name):
    """Close pencils about chief rays, in the meridional plane and across it, followed through mirrors and wall."""
    design = with_tube(sharp_design(name), wall_mm=5.0)
    for view in VIEW_NAMES:
        predicted = blurs_mm(design, view)
        traced = traced_blurs_mm(design, view)
        effect = np.abs(predicted - blurs_mm(design.model_copy(update={"housing": None}), view)).max()
        assert effect > 1e-4
        assert np.abs(predicted - traced).max() < 1e-4 * effect


def traced_blurs_mm(design: Design, name: str, step: float = 1e-5) -> np.ndarray:
    """Blurs (2, n, k) along and across the radius, by central differences."""
    instrument, view = build_instrument(design), design.views.by_name[name]
    path = instrument.path(view.path)
    chief = chief_rays(instrument, path, np.linspace(*view.elevation_deg, ELEVATIONS), np.pi / 3.0)
    sine, cosine, none = np.sin(chief.psi), np.cos(chief.psi), np.zeros(ELEVATIONS)
    ahead = np.stack([sine, none, cosine], axis=-1)
    asides = (np.stack([cosine, none, -sine], axis=-1), np.tile([0.0, 1.0, 0.0], (ELEVATIONS, 1)))

    def followed(starts: np.ndarray, headings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        trace = trace_sequential(instrument, path, headings, starts, apertures=False)
        through = refract(design.tube, trace.point, trace.direction)
        return through.at_outer, through.direction

    at_wall, out = followed(np.zeros_like(ahead), ahead)
    across = (np.stack([-out[:, 2], none, out[:, 0]], axis=-1), asides[1])
    lens = lens_of_camera(design.camera)
    blurs = []
    for aside, sideways in zip(asides, across, strict=True):
        rates = []
        for start, turn in ((aside, none[:, None]), (np.zeros_like(aside), aside)):
            ends = []
            for sign in (1.0, -1.0):
                point, heading = followed(
                    sign * step * start, np.cos(step * np.any(turn)) * ahead + np.sin(sign * step) * turn
                )
                along = np.einsum("ni,ni->n", heading, out)
                rise = np.einsum("ni,ni->n", heading, sideways) / along
                off = point - at_wall
                foot = np.einsum("ni,ni->n", off, sideways) - rise * np.einsum("ni,ni->n", off, out)
                ends.append((foot, rise))
            rates.append([(one - other) / (2.0 * step) for one, other in zip(*ends, strict=True)])
        columns = []
        for distance in design.working_volume.distance_mm:
            # The axis crossing counts as R = 0 with the sign of the outgoing direction.
            reach = (distance - np.abs(at_wall[:, 0])) / np.abs(out[:, 0])
            by_start, by_turn = (foot + reach * rise for foot, rise in rates)
            columns.append(lens.blur(by_start / by_turn / cosine))
        blurs.append(np.stack(columns, axis=-1))
    return np.stack(blurs)


def test_masses_and_blocked_share():
    design = with_tube(sharp_design(PIPE))
    tube = design.tube
    ring = np.pi * (tube.outer_radius_mm**2 - tube.inner_radius_mm**2) / 100.0  # cm2
    assert housing_mass_g(tube) == pytest.approx(1.19 * ring * (tube.high_mm - tube.low_mm) / 10.0)
    struts = with_struts(sharp_design(PIPE), number=4, width_mm=5.0)
    score = housing_score(struts)
    assert score.blocked_share == pytest.approx(4.0 * 5.0 / (2.0 * np.pi * struts.housing.radius_mm), rel=0.01)
    assert score.mass_g == pytest.approx(2.7 * 4.0 * np.pi * 0.25**2 * struts.housing.length_mm / 10.0)


def test_the_score_of_a_design_without_a_housing_says_nothing_of_one():
    assert "housing" not in evaluate_design(sharp_design(PIPE)).as_json()
    content = evaluate_design(with_tube(sharp_design(PIPE))).as_json()
    assert json.loads(json.dumps(content, allow_nan=False))["housing"]["kind"] == "tube"
