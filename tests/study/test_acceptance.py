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
from designer.evaluate.depth import depth_error_rms_second_order, noise_mm_of, stereo_pair_of, volume_of
from designer.evaluate.score import depth_score
from designer.requirement import set_key
from designer.study.task import solve_configuration
from designer.trace.instrument import sag
from designer.verify.judge import judge
from designer.verify.montecarlo import depth_error_monte_carlo
from designer.verify.verdict import Verdict
from support.shipped_problems import CONFIGURATIONS, SHIPPED, however_blurred, shipped_requirement

NOISE_PX = 0.1
# Enough for the standard error that is asked of every design below.
SAMPLES = 200_000


@pytest.mark.slow
@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_configuration_is_feasible_somewhere_and_as_good_as_it_says(name):
    designs: dict[str, Design] = {}
    said = []
    for asked in SHIPPED:
        result = solve_configuration(however_blurred(shipped_requirement(asked)), CONFIGURATIONS[name])
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


SHARP = (
    ("indoor_robot", "folded-HyHy-Hy-upper_outer"),
    ("pipe_inspection", "folded-ElPl-Hy-upper_inner"),
    ("ceiling_watch", "folded-HyEl-El-upper_outer"),
    ("sky_watch", "folded-ElPl-Hy-upper_inner"),
)


@pytest.mark.parametrize(("asked", "name"), SHARP)
def test_a_winner_is_sharp_and_what_spoils_its_light_is_named(asked, name):
    """By rays that fill the pupil, which know nothing of the closed form that the optimiser kept to."""
    # At f/5.6 no design that looks up as sky_watch does is sharp to 0.5 degrees.
    requirement = set_key(shipped_requirement(asked), "sharpness.max_blur_deg", 0.7 if asked == "sky_watch" else 0.5)
    design = solve_configuration(requirement, CONFIGURATIONS[name]).design
    assert design is not None
    verdict = judge(design)
    assert verdict.problems == ()
    for light in verdict.light.values():
        assert light.least_arriving > 0.995
        assert np.max(light.blur_deg) < 1.05 * requirement.sharpness.max_blur_deg
        assert light.mixed_in_zone == 0.0
    camera = design.camera
    near = camera.model_copy(update={"focus_distance_mm": 0.8 * camera.focus_distance_mm})
    assert_named(design.model_copy(update={"camera": near}), "blur of")
    wide = camera.model_copy(update={"f_number": camera.f_number / 4.0})
    assert_named(design.model_copy(update={"camera": wide}), "blur of")
    assert_named(first_rejected_with_a_cut_rim(design), "of the light arrives")


@pytest.mark.parametrize("name", ["folded-HyHy-Hy-upper_outer", "direct-HyHy-upper_inner"])
def test_an_uncertain_scale_is_minimised_with_the_noise_and_never_below_the_limit(name):
    """So uncertain a scale that, in a folded design, it outweighs the noise."""
    known = set_key(however_blurred(shipped_requirement("pipe_inspection")), "solve.starts", 4)
    uncertain = set_key(known, "scale_uncertainty_percent", 0.1)
    results = [solve_configuration(asked, CONFIGURATIONS[name]) for asked in (known, uncertain)]
    designs = [result.design for result in results]
    assert [design.scale_uncertainty for design in designs] == [0.0, 1e-3]
    rescored = depth_score(designs[0].model_copy(update={"scale_uncertainty": 1e-3}))
    row, score = results[1].row, depth_score(designs[1])
    assert row.number("depth_error_rms") == pytest.approx(score.depth_error_rms, rel=1e-9)
    assert row.number("first_stage_limit_ratio") >= 1.0 - 1e-9
    assert score.limit_ratio >= 1.0 - 1e-9
    # The first stage cannot lie above what another search, blind to the scale, came upon.
    assert row.number("first_stage_depth_error_rms") <= rescored.depth_error_rms * (1.0 + 1e-6)
    measured = depth_error_monte_carlo(designs[1], samples=SAMPLES, seed=0)
    noise_mm = noise_mm_of(designs[1])
    expected = depth_error_rms_second_order(stereo_pair_of(designs[1]), volume_of(designs[1]), noise_mm, 1e-3)
    assert measured.rms == pytest.approx(expected, rel=0.01)


def first_rejected_with_a_cut_rim(design: Design) -> Design:
    """The rim of the direct mirror turned down until the tracer objects: light goes before chief rays do."""
    mirror = design.mirrors[-1]
    for step in range(1, 200):
        spoilt = changed(design, mirror, outer_radius_mm=mirror.outer_radius_mm - 0.05 * step)
        if of_light(judge(spoilt, whole_image=False)):
            return spoilt
    raise AssertionError("whatever is cut, the tracer passes it")


def of_light(verdict: Verdict) -> tuple[str, ...]:
    """The problems but for an overall size that a cut mirror contradicts."""
    return tuple(problem for problem in verdict.problems if not problem.startswith(("height_mm", "diameter_mm")))


def assert_named(design: Design, *words: str) -> None:
    """The tracer rejects a design for the light of its full pupil, in these words and for nothing else."""
    problems = of_light(judge(design))
    assert all("full pupil" in problem for problem in problems), problems
    for word in words:
        assert any(word in problem for problem in problems), (word, problems)


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
        # The margin, and the light's width: no wider than the pupil where it meets the mirrors of these designs.
        cut = margin + 2.0 * design.camera.pupil_radius_mm
        rim, hole = mirror.outer_radius_mm - cut, mirror.inner_radius_mm + cut
        if rim > mirror.inner_radius_mm:
            yield f"outer rim of {mirror.name} cut", changed(design, mirror, outer_radius_mm=rim)
        if mirror.inner_radius_mm > 0.0 and hole < mirror.outer_radius_mm:
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
