"""All 44 under all shipped requirements: feasible somewhere, passed by the tracer, worth what is predicted.

Every design called feasible is judged, and measured with noisy projections through the tracer; the first one of each
configuration is spoiled in every way, and each spoiled copy must be rejected.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from designer.design import Design, Mirror
from designer.evaluate.depth import depth_error_rms_second_order, stereo_pair_of, volume_of
from designer.study.task import solve_configuration
from designer.trace.instrument import sag
from designer.verify.judge import judge
from designer.verify.montecarlo import depth_error_monte_carlo
from support.shipped_problems import CONFIGURATIONS, SHIPPED, shipped_requirement

NOISE_PX = 0.1
# Enough for the standard error that is asked of every design below.
SAMPLES = 200_000


@pytest.mark.slow
@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_configuration_is_feasible_somewhere_and_as_good_as_it_says(name):
    designs: dict[str, Design] = {}
    said = []
    for asked in SHIPPED:
        result = solve_configuration(shipped_requirement(asked), CONFIGURATIONS[name])
        assert result.status in {"feasible", "infeasible", "impossible"}, f"{asked}: {result.row.reason}"
        said.append(f"{asked}: {result.status} {result.row.reason}")
        if result.design is not None:
            designs[asked] = result.design
    assert designs, "\n".join(said)
    for asked, design in designs.items():
        assert_the_tracer_sees_everything(design, asked)
        assert_noise_does_what_is_predicted(design, asked)
    for what, spoiled in spoiled_copies(next(iter(designs.values()))):
        assert not judge(spoiled).passed, what


def assert_the_tracer_sees_everything(design: Design, where: str) -> None:
    verdict = judge(design)
    assert verdict.passed, (where, verdict.problems)
    for view in verdict.views.values():
        assert view.gaps_deg == ()
        assert view.svp_residual_mm < 1e-9, where
        assert view.gain_residual < 1e-9, where
        assert not any(blockage.is_asked for blockage in view.blockages)
    assert verdict.smallest_clearance_mm > 0.0


def assert_noise_does_what_is_predicted(design: Design, where: str) -> None:
    """The second order is needed: first order is up to 8 percent off where single points are uncertain by a fifth."""
    noise_mm = NOISE_PX * design.camera.pixel_pitch_mm
    predicted = depth_error_rms_second_order(stereo_pair_of(design), volume_of(design), noise_mm)
    measured = depth_error_monte_carlo(design, SAMPLES, seed=1, noise_px=NOISE_PX)
    assert measured.lost == 0
    assert measured.rms_standard_error < 0.006 * measured.rms, where
    assert measured.rms == pytest.approx(predicted, rel=0.02), where


def spoiled_copies(design: Design) -> Iterator[tuple[str, Design]]:
    """Copies of a good design, each with one thing wrong."""
    for mirror in design.mirrors:
        margin = shipped_requirement(SHIPPED[0]).manufacture.edge_margin_mm
        yield f"{mirror.name} shifted", changed(design, mirror, vertex_mm=mirror.vertex_mm + 0.01)
        if mirror.radius_mm is not None:
            yield f"conic of {mirror.name}", changed(design, mirror, conic=mirror.conic * 1.001)
            yield f"radius of {mirror.name}", changed(design, mirror, radius_mm=mirror.radius_mm * 1.001)
        rim = mirror.outer_radius_mm - margin - 0.01
        yield f"outer rim of {mirror.name} cut", changed(design, mirror, outer_radius_mm=rim)
        if mirror.inner_radius_mm > 0.0:
            hole = mirror.inner_radius_mm + margin + 0.01
            yield f"hole of {mirror.name} bored", changed(design, mirror, inner_radius_mm=hole)
    yield "lens swollen", with_swollen_lens(design)


def changed(design: Design, mirror: Mirror, **values: Any) -> Design:
    record = design.model_dump(by_alias=True)
    record["mirrors"] = [entry | (values if entry["name"] == mirror.name else {}) for entry in record["mirrors"]]
    return Design.model_validate(record)


def with_swollen_lens(design: Design) -> Design:
    """The lens barrel grown just into the lowest mirror: upwards, or sideways if that mirror stands around it."""
    camera = design.camera
    points = []
    for mirror in design.mirrors:
        for radius in (mirror.inner_radius_mm, mirror.outer_radius_mm):
            height = mirror.vertex_mm + float(sag(mirror, radius))
            below = 0.0 if mirror.faces == "down" else mirror.thickness_mm
            points.append((height - below, radius, mirror))
    height, radius, mirror = min(points, key=lambda point: point[0])
    if height < camera.lens_front_mm:
        radii = np.linspace(mirror.inner_radius_mm, mirror.outer_radius_mm, 1001)
        bottom = mirror.vertex_mm + sag(mirror, radii) - (0.0 if mirror.faces == "down" else mirror.thickness_mm)
        swollen = {"lens_radius_mm": radii[bottom < camera.lens_front_mm][0] + 0.1}
    else:
        grown = height + 0.01 - camera.lens_front_mm
        swollen = {
            "lens_front_mm": camera.lens_front_mm + grown,
            "lens_length_mm": camera.lens_length_mm + grown,
            "lens_radius_mm": max(camera.lens_radius_mm, radius + 0.1),
        }
    record = design.model_dump(by_alias=True)
    record["camera"] |= swollen
    return Design.model_validate(record)
