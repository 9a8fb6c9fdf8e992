"""The requirement as two columns of facts."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from designer.report.typst.markup import literal, plain_number, value_range
from designer.requirement import Requirement, requirement_to_toml

Facts = list[tuple[str, str]]


def requirement_groups(asked: Requirement) -> list[tuple[str, Facts]]:
    """What was asked, as groups of (name, value), from the requirement as its file holds it."""
    requirement = tomllib.loads(requirement_to_toml(asked))
    volume, envelope = requirement.get("working_volume", {}), requirement.get("envelope", {})
    camera, manufacture = requirement.get("camera", {}), requirement.get("manufacture", {})
    task = [
        _fact("elevation, from the middle", volume, "elevation_deg", "°"),
        _fact("distance from the axis", volume, "distance_mm", "mm"),
        _fact("baseline", requirement, "baseline_mm", "mm"),
        _fact("image noise, each view", requirement, "noise_px", "px"),
    ]
    size = [
        _fact("height, at most", envelope, "height_mm", "mm"),
        _fact("diameter, at most", envelope, "diameter_mm", "mm"),
        _fact("each mirror's diameter, at most", envelope, "mirror_diameter_mm", "mm"),
    ]
    sensor: list[tuple[str, str] | None] = [
        ("camera", str(camera["name"])) if camera.get("name") else None,
        _sensor(camera),
        _fact("image circle's radius", camera, "image_circle_radius_px", "px"),
        _fact("camera body's radius", camera, "body_radius_mm", "mm"),
        _fact("nearest mirror point, at least", camera, "nearest_mirror_mm", "mm"),
    ]
    making = [
        _fact("substrate thickness", manufacture, "substrate_thickness_mm", "mm"),
        _fact("edge margin", manufacture, "edge_margin_mm", "mm"),
        _fact("clearance", manufacture, "clearance_mm", "mm"),
        _fact("gap between the zones", manufacture, "zone_gap_px", "px"),
        _fact("mirror radius, at least", manufacture, "smallest_mirror_radius_mm", "mm"),
        _fact("surface slope, at most", manufacture, "largest_slope_deg", "°"),
    ]
    groups: list[tuple[str, Iterable[tuple[str, str] | None]]] = [
        ("Working volume", task),
        ("Envelope", size),
        ("Camera", sensor),
        *_lens_groups(camera.get("lens", {})),
        ("Manufacture", making),
        ("Objective", _objective(requirement)),
        ("Fixed by the requirement", _fixed(requirement.get("fixed", {}))),
    ]
    kept = [(title, [fact for fact in facts if fact is not None]) for title, facts in groups]
    return [(title, facts) for title, facts in kept if facts]


def facts_argument(groups: Iterable[tuple[str | None, Iterable[tuple[str, str]]]]) -> str:
    """Groups of facts as the Typst array that the style's ``facts`` takes."""
    parts = []
    for title, facts in groups:
        rows = "".join(f"({literal(name)}, {literal(value)}), " for name, value in facts)
        parts.append(f"({literal(title) if title is not None else 'none'}, ({rows})), ")
    return "(" + "".join(parts) + ")"


def objective_name(key: object) -> str:
    """An objective in words."""
    return str(key).replace("_", " ")


def _fact(name: str, table: dict[str, Any], key: str, unit: str) -> tuple[str, str] | None:
    value = table.get(key)
    if value is None:
        return None
    return name, value_range(value, unit).replace(" °", "°").replace("∞ mm", "infinity")


def _sensor(camera: dict[str, Any]) -> tuple[str, str] | None:
    if "width_px" not in camera or "height_px" not in camera:
        return None
    pitch = camera.get("pixel_pitch_mm")
    at = f" at {plain_number(round(1000 * pitch, 6))} µm" if isinstance(pitch, int | float) else ""
    return "sensor", f"{camera['width_px']} × {camera['height_px']} px{at}"


def _lens_groups(lens: dict[str, Any] | list[dict[str, Any]]) -> list[tuple[str, list[tuple[str, str] | None]]]:
    lenses = lens if isinstance(lens, list) else [lens]
    numbered = len(lenses) > 1
    return [
        (f"Lens {number} of {len(lenses)} to choose from" if numbered else "Lens", _lens_facts(entry))
        for number, entry in enumerate(lenses, start=1)
        if entry
    ]


def _lens_facts(lens: dict[str, Any]) -> list[tuple[str, str] | None]:
    return [
        ("lens", str(lens["name"])) if lens.get("name") else None,
        _fact("focal length", lens, "focal_length_mm", "mm"),
        _fact("focused at", lens, "focus_distance_mm", "mm"),
        _fact("f-number", lens, "f_number", ""),
        _fact("barrel radius", lens, "radius_mm", "mm"),
        _fact("front above entrance pupil", lens, "front_mm", "mm"),
        _fact("barrel length", lens, "length_mm", "mm"),
    ]


def _objective(requirement: dict[str, Any]) -> list[tuple[str, str] | None]:
    objective, solve = requirement.get("objective", {}), requirement.get("solve", {})
    then = objective.get("then")
    within = objective.get("within_percent")
    second = f"{objective_name(then)}, within {plain_number(within)} % of the first" if then else None
    return [
        ("minimise", objective_name(objective["minimise"])) if "minimise" in objective else None,
        ("then", second) if second else None,
        _fact("seed", solve, "seed", ""),
        _fact("starts", solve, "starts", ""),
    ]


def _fixed(fixed: dict[str, Any], prefix: str = "") -> list[tuple[str, str] | None]:
    facts: list[tuple[str, str] | None] = []
    for key, value in fixed.items():
        if isinstance(value, dict):
            facts.extend(_fixed(value, f"{prefix}{key} "))
        elif value is not None:
            facts.append((f"{prefix}{key}", value_range(value)))
    return facts
