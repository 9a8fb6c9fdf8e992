"""The record against itself: what a design file says of its mirrors must be what its surfaces are.

Surfaces, apertures, camera and working volume are taken at their word; everything else that is recorded follows from
them and is compared. Nothing is traced here. Lengths in mm, angles in degrees.
"""

from __future__ import annotations

import re

import numpy as np

from designer.design import ConicKind, Design, Interval, Mirror, ViewName
from designer.trace.arrays import Array
from designer.trace.instrument import sag

BASELINE_TOLERANCE_MM = 1e-6
# Sizes and ranges may have been typed in with a few decimals.
SIZE_TOLERANCE_MM = 1e-3
RANGE_TOLERANCE_DEG = 1e-3
# A conic constant this near to -1 may be called a paraboloid.
CONIC_TOLERANCE = 1e-9

# The judge reads names by itself: were it to use the designer's own table of the 44, a slip there would pass.
_KINDS: dict[str, ConicKind] = {"Pl": "plane", "Hy": "hyperboloid", "El": "ellipsoid", "Pa": "paraboloid"}
_DIRECT = re.compile(r"direct-(?P<lower>Hy|El)(?P<upper>Hy|El)-(?P<topology>upper_outer|upper_inner)")
_FOLDED = re.compile(
    r"folded-(?P<primary>Pl|Hy|El|Pa)(?P<secondary>Pl|Hy|El|Pa)-(?P<direct>Hy|El)-(?P<topology>upper_outer|upper_inner)"
)
_PATHS: dict[str, dict[ViewName, tuple[str, ...]]] = {
    "direct": {"upper": ("upper",), "lower": ("lower",)},
    "folded": {"upper": ("direct",), "lower": ("secondary", "primary")},
}


def record_problems(design: Design) -> list[str]:
    """One sentence for each recorded number or name that its surfaces or another record contradict, with both."""
    return [
        *_volume_problems(design),
        *_baseline_problems(design),
        *_range_problems(design),
        *_kind_problems(design),
        *_configuration_problems(design),
        *_size_problems(design),
    ]


def needed_elevations(design: Design) -> dict[ViewName, Interval] | None:
    """The elevations in degrees that each view needs to see the whole working volume, by the name of the view.

    The volume is seen from the middle of the baseline: the upper viewpoint sees the bottom of its near wall steepest
    and the top of its far wall highest, the lower one the reverse. None if there is no volume or no baseline.
    """
    low, high = design.working_volume.elevation_deg
    near, far = design.working_volume.distance_mm
    half = (design.views.upper.viewpoint_mm - design.views.lower.viewpoint_mm) / 2.0
    if not (-90.0 < low < high < 90.0 and 0.0 < near < far and 0.0 < half < np.inf):
        return None
    bottom, top = np.tan(np.radians([low, high]))
    ends: dict[ViewName, Array] = {
        "upper": np.degrees(np.arctan([bottom - half / near, top - half / far])),
        "lower": np.degrees(np.arctan([bottom + half / far, top + half / near])),
    }
    return {name: (float(low), float(high)) for name, (low, high) in ends.items()}


def topology_named_by(design: Design) -> str | None:
    """``upper_outer`` or ``upper_inner`` as the configuration's name has it; None if it is no configuration's name."""
    named = _named(design)
    return named["topology"] if named else None


def _named(design: Design) -> dict[str, str] | None:
    """Codes of the mirrors and the topology that the configuration's name gives; None if it is none of the 44."""
    found = _DIRECT.fullmatch(design.configuration) or _FOLDED.fullmatch(design.configuration)
    if found is None:
        return None
    named = found.groupdict()
    # Two planes have no power, and a paraboloid shares its focus at infinity with another paraboloid alone.
    pair = {named.get("primary"), named.get("secondary")}
    return None if pair == {"Pl"} or ("Pa" in pair and len(pair) == 2) else named


def _volume_problems(design: Design) -> list[str]:
    low, high = design.working_volume.elevation_deg
    near, far = design.working_volume.distance_mm
    problems = []
    if not -90.0 < low < high < 90.0:
        problems.append(f"working_volume.elevation_deg [{low:g}, {high:g}] is not an increasing range within -90..90")
    if not 0.0 < near < far:
        problems.append(f"working_volume.distance_mm [{near:g}, {far:g}] is not an increasing range above zero")
    return problems


def _baseline_problems(design: Design) -> list[str]:
    problems = []
    baseline = design.views.upper.viewpoint_mm - design.views.lower.viewpoint_mm
    if not baseline > 0.0:
        problems.append(f"the upper viewpoint is not above the lower one (baseline {baseline:.6g} mm)")
    if not abs(design.baseline_mm - baseline) <= BASELINE_TOLERANCE_MM:
        problems.append(f"baseline_mm is {design.baseline_mm:.9g}, but the viewpoints lie {baseline:.9g} mm apart")
    return problems


def _range_problems(design: Design) -> list[str]:
    needed = needed_elevations(design)
    problems = []
    for name, view in design.views.by_name.items():
        low, high = view.elevation_deg
        if not -90.0 < low < high < 90.0:
            problems.append(f"{name} view: elevation_deg [{low:g}, {high:g}] is not an increasing range within -90..90")
        elif needed and max(low - needed[name][0], needed[name][1] - high) > RANGE_TOLERANCE_DEG:
            wanted = needed[name]
            problems.append(
                f"{name} view: elevation_deg is [{low:.6g}, {high:.6g}], but the working volume needs "
                f"[{wanted[0]:.6g}, {wanted[1]:.6g}]"
            )
    return problems


def _kind_problems(design: Design) -> list[str]:
    return [
        f"{mirror.name}: kind is {mirror.kind}, but {_shape(mirror)}"
        for mirror in design.mirrors
        if not _is_kind(mirror, mirror.kind)
    ]


def _configuration_problems(design: Design) -> list[str]:
    named = _named(design)
    if named is None:
        return [f"configuration {design.configuration!r} is not one of the 44 (see `designer configurations`)"]
    family = design.configuration.split("-")[0]
    problems = []
    for name, view in design.views.by_name.items():
        expected = _PATHS[family][name]
        if view.path != expected:
            problems.append(
                f"configuration {design.configuration} forms its {name} view by {', '.join(expected)}, "
                f"but the path is {', '.join(view.path)}"
            )
    for mirror in design.mirrors:
        code = named.get(mirror.name)
        if code is not None and not _is_kind(mirror, _KINDS[code]):
            problems.append(
                f"configuration {design.configuration} has {_a(_KINDS[code])} as {mirror.name}, but {_shape(mirror)}"
            )
    return problems


def _is_kind(mirror: Mirror, kind: ConicKind) -> bool:
    """Whether a surface may be called that; close to a paraboloid either name will do."""
    if mirror.radius_mm is None or kind == "plane":
        return mirror.radius_mm is None and kind == "plane"
    beyond = mirror.conic + 1.0
    return {
        "paraboloid": abs(beyond) <= CONIC_TOLERANCE,
        "hyperboloid": beyond <= CONIC_TOLERANCE,
        "ellipsoid": beyond >= -CONIC_TOLERANCE,
    }[kind]


def _shape(mirror: Mirror) -> str:
    if mirror.radius_mm is None:
        return "without a radius it is a plane"
    curved: tuple[ConicKind, ...] = ("paraboloid", "hyperboloid", "ellipsoid")
    kind = next(kind for kind in curved if _is_kind(mirror, kind))
    return f"radius {mirror.radius_mm:.6g} mm and conic {mirror.conic:.9g} make {_a(kind)}"


def _a(kind: str) -> str:
    return f"{'an' if kind.startswith('e') else 'a'} {kind}"


def _size_problems(design: Design) -> list[str]:
    height, diameter = _overall_size(design)
    problems = []
    if not abs(design.height_mm - height) <= SIZE_TOLERANCE_MM:
        problems.append(f"height_mm is {design.height_mm:.9g}, but the height from lens to top is {height:.9g} mm")
    if not abs(design.diameter_mm - diameter) <= SIZE_TOLERANCE_MM:
        parts = "mirrors" if design.housing is None else "mirrors and the housing"
        problems.append(f"diameter_mm is {design.diameter_mm:.9g}, but the {parts} are {diameter:.9g} mm in diameter")
    camera = design.camera
    half_diagonal = float(np.hypot(camera.width_px, camera.height_px)) / 2.0
    circle = camera.image_circle_radius_px
    if circle is not None and circle > half_diagonal * (1.0 + 1e-12):
        problems.append(
            f"image_circle_radius_px is {circle:.9g}, but half the sensor's diagonal is {half_diagonal:.9g} px"
        )
    return problems


def _overall_size(design: Design) -> tuple[float, float]:
    """Height and diameter by the judge's own reckoning, from the surfaces that it traces."""
    heights = [design.camera.lens_front_mm]
    for mirror in design.mirrors:
        back = mirror.back_offset_mm
        for radius in (mirror.inner_radius_mm, mirror.outer_radius_mm):
            face = mirror.vertex_mm + float(sag(mirror, radius))
            heights += [face, face + back]
    widest = max(mirror.outer_radius_mm for mirror in design.mirrors)
    if design.housing is not None:
        heights += [design.housing.low_mm, design.housing.high_mm]
        widest = max(widest, design.housing.outer_radius_mm)
    # The lens front counts only as the lowest point: the camera is no part of the head.
    return max(heights[1:]) - min(heights), 2.0 * widest
