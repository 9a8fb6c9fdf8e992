"""A study folder as the study room writes it, made from closed forms, so that the report can be tested alone.

The optics are real (every mirror follows from its gain and foci); what a row says about solver and manufacture is
invented, which is all a layout test needs.
"""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

from designer.configurations import Configuration, enumerate_configurations
from designer.design import Design

PITCH_MM = 0.0044
FOCAL_LENGTH_MM = 12.0
IMAGE_RADIUS_PX = 600.0
ELEVATION_DEG = (-16.0, 16.0)
DISTANCE_MM = (1000.0, 5000.0)
NASTY_TITLE = 'Robot #1: "50 % *off*" $x$ _under_ <tag> \\path [bracket] @ref ünïcode 鏡'
REASON = (
    "the primary is an ellipsoid, and an ellipsoid cannot see a range that contains its own horizon: the ray would "
    "have to pass its own wall (asked -18.6 to 15.5 degrees) #let $x_1$ *bold* [a] <b> @c \\d"
)


def _half_tangent(slope: float, sense: str) -> float:
    return math.sqrt(1 + slope * slope) + (slope if sense == "direct" else -slope)


def _asked_slopes(baseline_mm: float) -> dict[str, tuple[float, float]]:
    low, high = (math.tan(math.radians(angle)) for angle in ELEVATION_DEG)
    near, far = DISTANCE_MM
    half = baseline_mm / 2
    return {"upper": (low - half / near, high - half / far), "lower": (low + half / far, high + half / near)}


def _conic(vertex_focus: float, other_focus: float, gain: float, facing: int) -> tuple[float, float, float]:
    """Vertex, radius and conic constant of the mirror between two foci (docs/theory.md, section 2)."""
    q = (1 - gain) / (1 + gain)
    c = facing * (other_focus - vertex_focus) / 2
    return vertex_focus + facing * c * (1 + q), facing * c * (1 - q * q) / q, -1 / (q * q)


def _ring_radius(focus: float, other_focus: float, gain: float, facing: int, tangent: float) -> float:
    q = (1 - gain) / (1 + gain)
    c = facing * (other_focus - focus) / 2
    psi = 2 * math.atan(tangent)
    return abs(c * (1 - q * q) / (math.cos(psi) - q) * math.sin(psi))


def prototype(
    baseline_mm: float = 100.0, fold_mm: float = 95.0, topology: str = "upper_outer", direct_kind: str = "hyperboloid"
) -> Design:
    """A system of the paper's kind: hyperboloidal primary, plane secondary, and a direct mirror of either kind."""
    slopes = _asked_slopes(baseline_mm)
    tangents = {
        "upper": sorted(_half_tangent(slope, "direct") for slope in slopes["upper"]),
        "lower": sorted(_half_tangent(slope, "folded") for slope in slopes["lower"]),
    }
    outer, inner = ("upper", "lower") if topology == "upper_outer" else ("lower", "upper")
    edge = math.tan(math.atan(IMAGE_RADIUS_PX * PITCH_MM / FOCAL_LENGTH_MM) / 2)
    gain = {outer: edge / tangents[outer][1]}
    gain[inner] = gain[outer] * tangents[outer][0] / tangents[inner][1]
    if direct_kind == "ellipsoid":
        gain["upper"] = -gain["upper"]
    lower_viewpoint = 2.0
    upper_viewpoint = lower_viewpoint + baseline_mm
    half = {view: [abs(gain[view]) * t for t in tangents[view]] for view in gain}
    primary = _conic(2 * fold_mm, lower_viewpoint, gain["lower"], -1)
    direct = _conic(0.0, upper_viewpoint, gain["upper"], 1)
    primary_rings = [_ring_radius(2 * fold_mm, lower_viewpoint, gain["lower"], -1, t) for t in half["lower"]]
    direct_rings = [_ring_radius(0.0, upper_viewpoint, gain["upper"], 1, t) for t in half["upper"]]
    plane_radius = fold_mm * math.tan(2 * math.atan(half["lower"][1]))
    mirrors = [
        _mirror("secondary", "plane", (fold_mm, None, 0.0), 0.0, plane_radius + 0.3, "down"),
        _mirror("primary", "hyperboloid", primary, primary_rings[0] - 0.5, primary_rings[1] + 0.5, "up"),
        _mirror("direct", direct_kind, direct, direct_rings[0] - 0.5, direct_rings[1] + 0.5, "down"),
    ]
    view = {"upper": (["direct"], upper_viewpoint, "direct"), "lower": (["secondary", "primary"], 2.0, "folded")}
    code = "Hy" if direct_kind == "hyperboloid" else "El"
    return _design(f"folded-HyPl-{code}-{topology}", mirrors, view, gain, slopes, outer, baseline_mm)


def two_direct_mirrors(baseline_mm: float = 100.0) -> Design:
    """A direct system of two hyperboloids, the lower one in the middle of the image."""
    slopes = _asked_slopes(baseline_mm)
    tangents = {name: sorted(_half_tangent(slope, "direct") for slope in slopes[name]) for name in slopes}
    edge = math.tan(math.atan(IMAGE_RADIUS_PX * PITCH_MM / FOCAL_LENGTH_MM) / 2)
    gain = {"upper": edge / tangents["upper"][1]}
    gain["lower"] = gain["upper"] * tangents["upper"][0] / tangents["lower"][1]
    viewpoints = {"lower": 60.0, "upper": 60.0 + baseline_mm}
    mirrors = []
    for name in ("lower", "upper"):
        rings = [_ring_radius(0.0, viewpoints[name], gain[name], 1, gain[name] * t) for t in tangents[name]]
        conic = _conic(0.0, viewpoints[name], gain[name], 1)
        mirrors.append(_mirror(name, "hyperboloid", conic, rings[0] - 0.3, rings[1] + 0.3, "down"))
    view = {name: ([name], viewpoints[name], "direct") for name in ("upper", "lower")}
    return _design("direct-HyHy-upper_outer", mirrors, view, gain, slopes, "upper", baseline_mm)


def crowd(count: int = 30) -> tuple[Design, ...]:
    """Many designs on four sizes and two errors, so that the trade plots have near-ties to label."""
    first = prototype()
    names = [configuration.name for configuration in enumerate_configurations()][:count]
    return tuple(
        first.model_copy(
            update={
                "configuration": name,
                "height_mm": 100.0 + 9.0 * (index % 4) + 0.01 * index,
                "diameter_mm": 50.0 + 0.3 * (index % 11),
                "score": {"depth_error_rms": 0.0121 + 0.0009 * (index % 2) + 1e-7 * index, "limit_ratio": 1.0},
            }
        )
        for index, name in enumerate(names)
    )


def _mirror(
    name: str, kind: str, conic: tuple[float, float | None, float], inner: float, outer: float, faces: str
) -> dict[str, Any]:
    return {
        "name": name,
        "kind": kind,
        "vertex_mm": conic[0],
        "radius_mm": conic[1],
        "conic": conic[2],
        "inner_radius_mm": inner,
        "outer_radius_mm": outer,
        "thickness_mm": 2.5,
        "faces": faces,
    }


def _design(
    configuration: str,
    mirrors: list[dict[str, Any]],
    view: dict[str, tuple[list[str], float, str]],
    gain: dict[str, float],
    slopes: dict[str, tuple[float, float]],
    outer: str,
    baseline_mm: float,
) -> Design:
    views = {
        name: {
            "path": view[name][0],
            "viewpoint_mm": view[name][1],
            "gain": gain[name],
            "sense": view[name][2],
            "elevation_deg": [math.degrees(math.atan(slope)) for slope in slopes[name]],
            "zone": "outer" if name == outer else "inner",
        }
        for name in ("upper", "lower")
    }
    levels = [mirror["vertex_mm"] for mirror in mirrors]
    overall_height_mm = max(levels) - min(levels) + 12.0
    return Design.model_validate(
        {
            "schema": 1,
            "configuration": configuration,
            "variant": "primary around the lens, direct mirror above the secondary",
            "camera": {
                "focal_length_mm": FOCAL_LENGTH_MM,
                "pixel_pitch_mm": PITCH_MM,
                "width_px": 1600,
                "height_px": 1200,
                "f_number": 4.0,
                "lens_radius_mm": 9.0,
                "lens_front_mm": 6.0,
                "lens_length_mm": 30.0,
                "body_radius_mm": 15.0,
                "image_circle_radius_px": IMAGE_RADIUS_PX,
            },
            "mirrors": mirrors,
            "views": views,
            "baseline_mm": baseline_mm,
            "height_mm": overall_height_mm,
            "diameter_mm": 2 * max(mirror["outer_radius_mm"] for mirror in mirrors),
            "working_volume": {"elevation_deg": list(ELEVATION_DEG), "distance_mm": list(DISTANCE_MM)},
            "noise_px": 0.1,
            "score": {"depth_error_rms": 0.0123, "limit_ratio": 1.002},
        }
    )


REQUIREMENT = """\
name = {name}
title = {title}
description = "An indoor robot that looks all around, \\"1 to 5 m\\" #away, for $5 & <more>."
baseline_mm = 100.0
noise_px = 0.1

[working_volume]
elevation_deg = [-16.0, 16.0]
distance_mm = [1000.0, 5000.0]

[envelope]
height_mm = 140.0
diameter_mm = 80.0
mirror_diameter_mm = 60.0

[camera]
name = "Some_Camera #2 (1/1.8\\")"
width_px = 1600
height_px = 1200
pixel_pitch_mm = 0.0044
image_circle_radius_px = 600.0
body_radius_mm = 15.0
nearest_mirror_mm = 40.0

[camera.lens]
name = "S-mount 12 mm"
focal_length_mm = 12.0
focus_distance_mm = inf
f_number = 4.0
radius_mm = 9.0
front_mm = 6.0
length_mm = 30.0

[manufacture]
substrate_thickness_mm = 2.5
edge_margin_mm = 0.5
clearance_mm = 0.5
zone_gap_px = 4.0
smallest_mirror_radius_mm = 5.0
largest_slope_deg = 60.0

[objective]
minimise = "depth_error"
then = "height"
within_percent = 1.0

[solve]
seed = 7
starts = 24
configurations = ["*"]
"""


def write_sample_study(
    folder: Path, *, name: str = "sample", title: str = NASTY_TITLE, designs: tuple[Design, ...] | None = None
) -> Path:
    """Write the files of a study (all but the report) and return its folder."""
    if designs is None:
        designs = (
            prototype(),
            two_direct_mirrors(),
            prototype(topology="upper_inner"),
            prototype(direct_kind="ellipsoid"),
        )
    (folder / "designs").mkdir(parents=True, exist_ok=True)
    (folder / "requirement.toml").write_text(
        REQUIREMENT.format(name=json.dumps(name), title=json.dumps(title)), encoding="utf-8"
    )
    by_name = {design.configuration: design for design in designs}
    for design in designs:
        text = json.dumps(design.model_dump(mode="json", by_alias=True), indent=2)
        (folder / "designs" / f"{design.configuration}.json").write_text(text, encoding="utf-8")
    rows = [_row(configuration, by_name) for configuration in enumerate_configurations()]
    with (folder / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    _write_fronts(folder, designs)
    (folder / "provenance.json").write_text(json.dumps(PROVENANCE, indent=2), encoding="utf-8")
    return folder


def _row(configuration: Configuration, by_name: dict[str, Design]) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(COLUMN_NAMES.split(), "")
    row |= {"configuration": configuration.name, "family": configuration.family, "topology": configuration.topology}
    row |= {"starts": 24, "solves": 31, "seconds": 0.21}
    if configuration.name in by_name:
        design = by_name[configuration.name]
        rank = list(by_name).index(configuration.name) + 1
        return row | {
            "status": "feasible",
            "depth_error_rms": design.score["depth_error_rms"],
            "limit_ratio": design.score["limit_ratio"],
            "baseline_mm": design.baseline_mm,
            "height_mm": design.height_mm,
            "diameter_mm": design.diameter_mm,
            "rank": rank,
            "variant": design.variant,
            "first_stage_depth_error_rms": 0.0121,
            "first_stage_height_mm": 131.0,
            "first_stage_diameter_mm": 71.0,
            "volume_cm3": 210.0,
            "largest_mirror_diameter_mm": design.diameter_mm,
            "principal_distance_mm": 12.0,
            "lens": "S-mount 12 mm",
            "depth_error_worst": 0.0312,
            "smallest_clearance_mm": 0.5,
            "smallest_clearance_where": "world leg of the lower view, lowest elevation, past the rim of the primary",
            "largest_slope_deg": 31.2,
        }
    if "El" in configuration.name:
        return row | {"status": "impossible", "reason": REASON}
    if "Pa" in configuration.name:
        return row | {
            "status": "infeasible",
            "reason": "no feasible point: the diameter came closest, 3.2 mm over its limit",
            "closest_constraint": "diameter of the mirror system",
            "closest_violation": 3.2,
            "closest_unit": "mm",
        }
    return row | {"status": "failed", "reason": "RuntimeError: the solver returned no number"}


COLUMN_NAMES = (
    "configuration family topology status reason depth_error_rms limit_ratio baseline_mm height_mm diameter_mm rank "
    "variant first_stage_depth_error_rms first_stage_height_mm first_stage_diameter_mm volume_cm3 "
    "largest_mirror_diameter_mm principal_distance_mm lens depth_error_worst smallest_clearance_mm "
    "smallest_clearance_where largest_slope_deg closest_constraint closest_violation closest_unit starts solves seconds"
)

PROVENANCE = {
    "versions": {"designer": "0.1.0", "python": "3.11.9", "casadi": "3.7.2", "numpy": "2.4.0"},
    "seed": 7,
    "command": 'designer study "configs/#1.toml" --out reports/x_y',
    "started": "2026-01-02T03:04:05+00:00",
    "elapsed_seconds": 9.4,
    "machine": {"processor": "x86_64", "cores": 2},
    "solver": {"name": "sqpmethod", "tol_pr": 1e-9},
}


def _write_fronts(folder: Path, designs: tuple[Design, ...]) -> None:
    lines = ["configuration,swept,limit_mm,status,depth_error_rms,height_mm,diameter_mm"]
    for rank, design in enumerate(designs[:5], start=1):
        for step in range(8):
            height, diameter = 100.0 + 3 * rank - 4 * step, design.diameter_mm - 1.5 * step
            error = 0.0121 * (1 + 0.01 * step * step)
            lines.append(f"{design.configuration},height_mm,{height},feasible,{error},{height},{design.diameter_mm}")
            lines.append(f"{design.configuration},diameter_mm,{diameter},feasible,{error},{height},{diameter}")
        lines.append(f"{design.configuration},height_mm,60,infeasible,,,")
    (folder / "fronts.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
