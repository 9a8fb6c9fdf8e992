"""The comparators: one entry each, and what designs one for a requirement."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from designer.comparators import lobes, planar, spheres, stacked
from designer.comparators.asked import Asked
from designer.comparators.errors import worst_depth_error
from designer.comparators.judged import problems_of
from designer.comparators.row import ComparatorRow
from designer.comparators.search import KEPT, Goal, Measured, Space, error_of_trial, height_of_trial, search
from designer.design import Camera, Mirror
from designer.optics.thin_lens import nominal_focal_length
from designer.requirement import Requirement

# A smooth maximum of height and diameter, each as a share of the envelope's.
SHARPNESS_OF_SIZE = 8.0


@dataclass(frozen=True, slots=True)
class Idea:
    """One way to build a panoramic stereo sensor other than the 44.

    ``spaces`` are to be searched, each for a way of putting it together, and ``problems`` is the judge's word on what
    was found. ``then`` is the second goal, after the depth error.
    """

    title: str
    cameras: int
    spaces: Callable[[Asked], Iterable[Space[Any]]]
    problems: Callable[[Asked, Any], list[str]]
    described: Callable[[Any], tuple[float, str]]
    then: Goal = height_of_trial


def _mirrors_in_words(mirrors: Iterable[Mirror]) -> str:
    return "; ".join(
        f"{mirror.name}: vertex {mirror.vertex_mm:.6g} mm, radius {mirror.radius_mm:.6g} mm, conic {mirror.conic:.6g}, "
        f"from {mirror.inner_radius_mm:.4g} to {mirror.outer_radius_mm:.4g} mm"
        for mirror in mirrors
    )


def _describe_coaxial(built: Any) -> tuple[float, str]:
    """Azimuths seen, in degrees, and the mirrors in words, each in the frame of its own camera."""
    own = [next(m for m in built.heads[view.head].mirrors if m.name == view.mirror) for view in built.views.values()]
    words = _mirrors_in_words(own)
    if len(built.heads) == 1:
        return 360.0, words
    upper = built.views["upper"].view
    way = "down" if upper.is_inverted else "up"
    return 360.0, f"{words}; upper pinhole at {upper.pinhole_mm:.6g} mm, looking {way}"


def _describe_planar(built: planar.Planar) -> tuple[float, str]:
    words = "; ".join(
        f"{name}: meets the axis at {plate.flat.height:.6g} mm, rises {math.degrees(plate.flat.incline):.5g} deg, "
        f"{plate.high - plate.low:.4g} mm x {2.0 * plate.half:.4g} mm"
        for name, plate in zip(("lower", "upper"), built.plates, strict=True)
    )
    return math.degrees(2.0 * built.half_azimuth), words


def _per_azimuth(trial: Measured[planar.Planar]) -> float:
    return 1.0 / trial.built.half_azimuth


COMPARATORS: dict[str, Idea] = {
    "stacked_cameras": Idea("two stacked omnidirectional cameras", 2, stacked.spaces, problems_of, _describe_coaxial),
    "double_lobed_mirror": Idea(
        "double-lobed mirror", 1, lobes.spaces, partial(problems_of, border=True), _describe_coaxial
    ),
    "two_spheres": Idea("two spheres", 1, spheres.spaces, problems_of, _describe_coaxial),
    "planar_mirrors": Idea(
        "two plane mirrors", 1, planar.spaces, planar.problems_of, _describe_planar, then=_per_azimuth
    ),
}
"""Every comparator by its name."""


def design_comparator(requirement: Requirement, name: str) -> ComparatorRow:
    """The best design of one idea for a requirement; where none fits its envelope, the smallest of the asked baseline.

    Searches start from the requirement's seed: the same requirement gives the same design.
    """
    idea = COMPARATORS[name]
    asked = [Asked.of(requirement, lens) for lens in requirement.camera.lenses]
    found = list(_found(idea, asked, error_of_trial, idea.then))
    if found:
        best = min(found, key=lambda pair: pair[1].error)
        return _row(name, *best, status="feasible", reason="")
    envelope = requirement.envelope

    def times_the_envelope(trial: Measured[Any]) -> float:
        shares = trial.height / envelope.height_mm, trial.diameter / envelope.diameter_mm
        return float(sum(share**SHARPNESS_OF_SIZE for share in shares) ** (1.0 / SHARPNESS_OF_SIZE))

    freed = [each.without_envelope() for each in asked]
    found = list(_found(idea, freed, times_the_envelope, error_of_trial))
    if not found:
        return ComparatorRow(
            name, idea.title, "infeasible", "no design was found, in an envelope of any size", idea.cameras
        )
    best = min(found, key=lambda pair: times_the_envelope(pair[1]))
    trial = best[1]
    reason = (
        f"does not fit into {envelope.height_mm:g} mm x {envelope.diameter_mm:g} mm: with the baseline asked for the "
        f"smallest found is {trial.height:.0f} mm high and {trial.diameter:.0f} mm wide"
    )
    return _row(name, *best, status="too_large", reason=reason)


def _found(idea: Idea, asked: Iterable[Asked], first: Goal, then: Goal) -> Iterator[tuple[Asked, Measured[Any]]]:
    """From each lens and space the best trial with which the judge finds nothing wrong."""
    for each in asked:
        solve = each.requirement.solve
        for space in idea.spaces(each):
            trials = search(space, solve.seed, each.requirement.objective.tolerance, first, then)
            passed = (trial for trial in trials if trial.violation <= KEPT and not idea.problems(each, trial.built))
            trial = next(passed, None)
            if trial is not None:
                yield each, trial


def _row(name: str, asked: Asked, trial: Measured[Any], *, status: Any, reason: str) -> ComparatorRow:
    idea, built = COMPARATORS[name], trial.built
    azimuth, prescription = idea.described(built)
    camera: Camera = built.rig.lower.camera
    focus = camera.focus_distance_mm
    return ComparatorRow(
        comparator=name,
        title=idea.title,
        status=status,
        reason=reason,
        cameras=idea.cameras,
        azimuth_deg=azimuth,
        depth_error_rms=trial.error,
        depth_error_worst=worst_depth_error(built.rig, asked.volume, asked.conditions, asked.scale_uncertainty),
        baseline_mm=built.baseline_mm,
        height_mm=built.height_mm,
        diameter_mm=built.diameter_mm,
        largest_blur_px=built.largest_blur_px,
        largest_blur_deg=built.largest_blur_deg,
        single_viewpoint_error_mm=built.single_viewpoint_error_mm,
        focal_length_mm=float(nominal_focal_length(camera.focal_length_mm, focus or math.inf)),
        f_number=camera.f_number,
        focus_distance_mm=focus,
        prescription=prescription,
    )
