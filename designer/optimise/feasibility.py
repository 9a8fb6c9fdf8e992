"""What is impossible by rule, before any search: the reasons are sentences for the report."""

from __future__ import annotations

import math
from collections.abc import Mapping

from designer.configurations import Configuration, MirrorKind
from designer.optics.view import elevation_tangents_of_views
from designer.optimise.box import Ranges, limits_at
from designer.optimise.rules import Rules
from designer.optimise.variants import Variant

_KIND_WORDS = {
    MirrorKind.PLANE: "plane",
    MirrorKind.HYPERBOLOID: "hyperboloid",
    MirrorKind.ELLIPSOID: "ellipsoid",
    MirrorKind.PARABOLOID: "paraboloid",
}


def why_impossible(variant: Variant, rules: Rules, ranges: Ranges) -> str | None:
    """The rule that forbids a variant under a requirement, as a sentence; None if none does.

    A concave last mirror sends its light through the viewpoint, so it cannot see a range that contains its own
    horizon: the ray would have to pass the mirror's own wall. A plane primary sees only what lies above it.
    """
    kinds = variant.configuration.mirror_kinds
    for view in ("lower", "upper"):
        spans = [_span_deg(rules, baseline, view) for baseline in ranges.baseline]
        mirror = variant.last_mirror(view)
        shown = spans[0]
        if variant.crosses_at_viewpoint(view) and not _can_leave_horizon(spans):
            word = "concave " * (kinds[mirror] is MirrorKind.PARABOLOID) + _KIND_WORDS[kinds[mirror]]
            article = "an" if word[0] == "e" else "a"
            return (
                f"{article} {word} cannot see a range that contains its own horizon, and the {view} view "
                f"must see {shown[0]:.1f} to {shown[1]:.1f} degrees"
            )
        if kinds[mirror] is MirrorKind.PLANE and max(low for low, _ in spans) <= 0.0:
            return (
                f"a plane primary sees only above its horizon, and the {view} view must see "
                f"{shown[0]:.1f} to {shown[1]:.1f} degrees"
            )
    gains = [
        min(limits_at(variant, rules, baseline, distance).values())
        for baseline in ranges.baseline
        for distance in ranges.principal_distance
    ]
    if max(gains) <= 0.0:
        return "the outer zone and the gap leave no room for the inner zone"
    return None


def why_fixed_conflicts(configuration: Configuration, fixed: Mapping[str, float]) -> str | None:
    """Why a fixed parameter cannot belong to a configuration; None if it can."""
    kinds = configuration.mirror_kinds
    for key, value in fixed.items():
        owner, _, quantity = key.partition(".")
        if quantity in {"viewpoint_mm", "gain"}:
            continue
        if owner not in kinds:
            return f"a {owner} mirror is given, and the configuration has none"
        kind = kinds[owner]
        if kind is MirrorKind.PLANE and quantity in {"radius_mm", "conic"}:
            return f"the given {owner} mirror is curved, and the configuration's is a plane"
        if quantity == "conic" and kind is not (given := _kind_of_conic(value)):
            return (
                f"the given {owner} mirror (conic constant {value:g}) is a {_KIND_WORDS[given]}, "
                f"and the configuration's is a {_KIND_WORDS[kind]}"
            )
    return None


def _kind_of_conic(conic: float) -> MirrorKind:
    if conic == -1.0:
        return MirrorKind.PARABOLOID
    return MirrorKind.HYPERBOLOID if conic < -1.0 else MirrorKind.ELLIPSOID


def _span_deg(rules: Rules, baseline: float, view: str) -> tuple[float, float]:
    upper, lower = elevation_tangents_of_views(
        (math.tan(rules.elevation_low), math.tan(rules.elevation_high)),
        (rules.distance_near, rules.distance_far),
        baseline,
    )
    low, high = upper if view == "upper" else lower
    return math.degrees(math.atan(low)), math.degrees(math.atan(high))


def _can_leave_horizon(spans: list[tuple[float, float]]) -> bool:
    """Whether at some allowed baseline the range lies wholly on one side: both its ends move one way with it."""
    return max(low for low, _ in spans) > 0.0 or min(high for _, high in spans) < 0.0
