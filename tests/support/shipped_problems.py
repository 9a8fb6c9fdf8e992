"""The shipped requirements as optimisation problems, random designs of them, and their design records."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.configurations import Configuration, enumerate_configurations
from designer.design import Design
from designer.optics.view import elevation_tangents_of_views
from designer.optimise.constraints import constraints_of
from designer.optimise.problem import Problem, violations_of
from designer.optimise.required_numbers import specification_of
from designer.optimise.screening import draw
from designer.optimise.system import System
from designer.optimise.variables import bounds_of, free_ranges
from designer.optimise.variants import Variant, enumerate_variants
from designer.requirement import Requirement, read_requirement, set_key
from support import CONFIGS

Array = NDArray[np.float64]

SHIPPED = ("indoor_robot", "pipe_inspection", "ceiling_watch", "sky_watch")
CONFIGURATIONS = {configuration.name: configuration for configuration in enumerate_configurations()}
VARIANTS = tuple(variant for configuration in CONFIGURATIONS.values() for variant in enumerate_variants(configuration))


def variant_name(variant: Variant) -> str:
    """The configuration and what distinguishes the variant, for test names."""
    return f"{variant.configuration.name} {variant.label}".strip().replace(" ", "_")


@cache
def shipped_requirement(name: str) -> Requirement:
    """One of the requirements that come with the designer, with the noise and the stop of the paper, and a known scale.

    Geometry does not depend on them, and a predicted noise takes the optimiser half as long again.
    """
    requirement = requirement_as_shipped(name)
    for key, value in (("noise_px", 0.1), ("scale_uncertainty_percent", 0), ("camera.lens.f_number", 5.6)):
        requirement = set_key(requirement, key, value)
    return requirement


@cache
def requirement_as_shipped(name: str) -> Requirement:
    """One of the requirements that come with the designer, word for word."""
    return read_requirement(CONFIGS / f"{name}.toml")


def however_blurred(requirement: Requirement) -> Requirement:
    """The requirement with any blur allowed, and one focus: more configurations are feasible, and sooner."""
    return set_key(set_key(requirement, "sharpness.max_blur_deg", math.inf), "camera.lens.focus_distance_mm", 100)


def with_thin_light(requirement: Requirement) -> Requirement:
    """The requirement with any blur allowed, and so small a stop that light is almost as thin as chief rays."""
    return set_key(however_blurred(requirement), "camera.lens.f_number", 128)


def toml_with_constant_noise(text: str) -> str:
    """The text of the indoor robot's requirement with 0.1 px of noise alone, at f/5.6, which is quicker to solve."""
    for line, instead in (
        (r"^noise_px = .*$", "noise_px = 0.1 # px\nscale_uncertainty_percent = 0"),
        (r"^f_number = .*$", "f_number = 5.6"),
    ):
        text, count = re.subn(line, instead, text, flags=re.MULTILINE)
        assert count == 1
    return text


def toml_with_coarse_pixels(text: str) -> str:
    """The text of the indoor robot's requirement with pixels twice as large on the same sensor."""
    for fine, coarse in (("1600", "800"), ("1200", "600"), ("0.0044", "0.0088")):
        assert text.count(f"= {fine}\n") == 1
        text = text.replace(f"= {fine}\n", f"= {coarse}\n")
    return text


def problem_of(requirement: Requirement, variant: Variant, fixed: tuple[tuple[str, float], ...] = ()) -> Problem:
    """The problem of one variant with the first lens, whether or not a rule calls it impossible."""
    lens = requirement.camera.lenses[0]
    specification = specification_of(requirement, lens)
    ranges = free_ranges(requirement, lens)
    return Problem(variant, specification, bounds_of(variant, specification, ranges), fixed)


def problems_of(requirement: Requirement, configuration: Configuration) -> Iterator[Problem]:
    """The problem of every variant."""
    for variant in enumerate_variants(configuration):
        yield problem_of(requirement, variant)


def random_designs(problem: Problem, count: int, seed: int, f_number: float | None = None) -> dict[str, Array]:
    """Variables of random designs, drawn as the optimiser draws its starts, each of shape (count,).

    With an f-number of their own, such as one at which no more than chief rays are left.
    """
    with np.errstate(all="ignore"):
        drawn = draw(problem, count, np.random.default_rng(seed))
        values, _ = problem.enclosed(drawn if f_number is None else drawn | {"f_number": np.full(count, f_number)})
    return {name: np.broadcast_to(np.asarray(value, dtype=float), (count,)) for name, value in values.items()}


CHIEF_RAYS_ALONE = 1e12
"""An f-number at which light has no width."""


def at(values: dict[str, Array], index: int) -> dict[str, Array]:
    """The variables of one design, each of shape (1,)."""
    return {name: value[index : index + 1] for name, value in values.items()}


def put_together(problem: Problem, values: dict[str, Array]) -> System:
    """Designs put together with their enclosure set to what the mirrors need."""
    with np.errstate(all="ignore"):
        return problem.enclosed(values)[1]


STRUCTURAL = {
    "vertex_sheet",
    "used_ring",
    "primary_kind",
    "primary_vertex_side",
    "primary_below_secondary",
    "steepest_slope",
}
"""Kinds of constraints without which the formulas do not describe a system."""


def is_coherent(system: System) -> NDArray[np.bool_]:
    """Which designs the formulas hold for: vertex sheets, rings with an inside, a primary below its secondary.

    The formulas know lines, not rays: they would also lay out a secondary that sends its light backwards.
    """
    constraints = tuple(item for item in constraints_of(system, {}) if item.kind in STRUCTURAL)
    return np.asarray(violations_of(constraints).max(axis=0) == 0.0)


def zones_fit(system: System) -> NDArray[np.bool_]:
    """Which designs have both image zones inside the image circle, and apart by the gap asked."""
    amounts = [item.value for item in constraints_of(system, {}) if item.kind in {"image_circle", "zone_gap"}]
    return np.asarray(np.min(np.broadcast_arrays(*amounts), axis=0) >= 0.0)


def design_record(requirement: Requirement, problem: Problem, values: dict[str, Array]) -> Design:
    """The design record of one design, made from its layout alone; its variables have shape (1,)."""
    variant, specification = problem.variant, problem.specification
    lens, camera = requirement.camera.lenses[0], requirement.camera
    system = put_together(problem, values)
    reciprocal_focus = _number(values["reciprocal_focus"])
    kinds = variant.configuration.mirror_kinds
    words = {"Pl": "plane", "Hy": "hyperboloid", "El": "ellipsoid", "Pa": "paraboloid"}
    mirrors = []
    for mirror in system.layout.mirrors:
        curvature, conic_term = _number(mirror.surface.curvature), _number(mirror.surface.conic_term)
        is_plane = kinds[mirror.name].value == "Pl"
        mirrors.append(
            {
                "name": mirror.name,
                "kind": words[kinds[mirror.name].value],
                "vertex_mm": _number(mirror.surface.vertex_height),
                "radius_mm": None if is_plane else 1.0 / curvature,
                "conic": 0.0 if is_plane else conic_term / curvature**2 - 1.0,
                "inner_radius_mm": _number(mirror.inner_radius),
                "outer_radius_mm": _number(mirror.outer_radius),
                "thickness_mm": requirement.manufacture.substrate_thickness_mm,
                "faces": "down" if mirror.direction > 0 else "up",
            }
        )
    baseline, lower = _number(values["baseline"]), _number(values["lower_viewpoint"])
    ranges = elevation_tangents_of_views(
        tuple(math.tan(elevation) for elevation in specification.elevations),
        specification.distances,
        baseline,
    )

    def view(name: str, viewpoint: float, slopes: tuple[float, float]) -> dict[str, Any]:
        last = variant.last_mirror(name)
        is_outer = (variant.configuration.topology == "upper_outer") == (name == "upper")
        return {
            "path": ["secondary", last] if variant.sense(name) == "folded" else [last],
            "viewpoint_mm": viewpoint,
            "gain": _number(values[f"{name}_gain"]),
            "sense": variant.sense(name),
            "elevation_deg": [math.degrees(math.atan(slope)) for slope in slopes],
            "zone": "outer" if is_outer else "inner",
        }

    return Design.model_validate(
        {
            "schema": 1,
            "configuration": variant.configuration.name,
            "camera": {
                "focal_length_mm": _number(values["principal_distance"]),
                "pixel_pitch_mm": camera.pixel_pitch_mm,
                "width_px": camera.width_px,
                "height_px": camera.height_px,
                "f_number": _number(values["f_number"]),
                "focus_distance_mm": 1.0 / reciprocal_focus if reciprocal_focus else None,
                "lens_radius_mm": lens.radius_mm,
                "lens_front_mm": lens.front_mm,
                "lens_length_mm": lens.length_mm,
                "body_radius_mm": camera.body_radius_mm,
                "image_circle_radius_px": camera.image_circle_radius_px,
            },
            "mirrors": mirrors,
            "views": {
                "upper": view("upper", lower + baseline, ranges.upper),
                "lower": view("lower", lower, ranges.lower),
            },
            "baseline_mm": baseline,
            "height_mm": _number(system.height),
            "diameter_mm": _number(system.diameter),
            "working_volume": {
                "elevation_deg": list(requirement.working_volume.elevation_deg),
                "distance_mm": list(requirement.working_volume.distance_mm),
            },
            "noise_px": 0.1,
        }
    )


def _number(value: Any) -> float:
    return float(np.ravel(value)[0])
