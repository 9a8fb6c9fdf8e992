"""What is impossible by rule, before any search: the reasons are sentences for the report."""

from __future__ import annotations

import math
from collections.abc import Mapping

from designer.configurations import VIEW_OF_SINGLE_MIRROR, Configuration, MirrorKind, with_article
from designer.design import VIEW_NAMES, ViewName
from designer.optics.kinds import inverse_eccentricities, kind_of_conic, kind_of_single_mirror, radius_signs
from designer.optimise.limit import limiting_gains
from designer.optimise.reach import sampled, slopes_at
from designer.optimise.required_numbers import Specification
from designer.optimise.variables import FreeRanges
from designer.optimise.variants import Variant, enumerate_variants


def why_impossible(variant: Variant, specification: Specification, free: FreeRanges) -> str | None:
    """The rule that forbids a variant under a requirement, as a sentence; None if none does.

    A concave last mirror sends its light through the viewpoint, so it cannot see a range that contains its own
    horizon: the ray would have to pass the mirror's own wall. A plane primary sees only what lies above it. A ray of
    slope s that a mirror of radius R reflects lies at most abs(s) R above or below the viewpoint there, so the envelope
    limits the baseline.
    """
    baseline, envelope = min(free.baseline), specification.asked.envelope
    if baseline > (largest := _largest_baseline(specification, baseline)):
        return (
            f"mirrors {envelope.mirror_diameter_mm:g} mm wide in an envelope {envelope.height_mm:g} mm high "
            f"have viewpoints at most {largest:.4g} mm apart, but the baseline must be {baseline:g} mm"
        )
    kinds = variant.configuration.mirror_kinds
    for view in reversed(VIEW_NAMES):
        spans = [_span_deg(specification, baseline, view) for baseline in free.baseline]
        mirror = variant.last_mirror(view)
        shown = spans[0]
        if variant.crosses_at_viewpoint(view) and not _can_leave_horizon(spans):
            concave = kinds[mirror] is MirrorKind.PARABOLOID
            words = f"a concave {kinds[mirror].word}" if concave else with_article(kinds[mirror].word)
            return (
                f"{words} cannot see a range that contains its own horizon, but the {view} view must cover "
                f"{shown[0]:.1f} to {shown[1]:.1f} degrees"
            )
        if kinds[mirror] is MirrorKind.PLANE and max(low for low, _ in spans) <= 0.0:
            return (
                f"a plane primary sees only above its horizon, but the {view} view must cover "
                f"{shown[0]:.1f} to {shown[1]:.1f} degrees"
            )
    gains = [
        limiting_gains(variant, specification, baseline, distance)
        for baseline in sampled(free.baseline)
        for distance in free.principal_distance
    ]
    if max(min(each.lower, each.upper) for each in gains) <= 0.0:
        return "the outer zone and the gap leave no space for the inner zone"
    return None


def why_fixed_conflicts(configuration: Configuration, fixed: Mapping[str, float]) -> str | None:
    """Why a fixed parameter cannot belong to a configuration; None if it can.

    Parameters
    ----------
    configuration
        One of the 44.
    fixed
        Numbers by names such as ``primary.radius_mm`` and ``upper.gain``, which do not exclude each other in general.
    """
    kinds = configuration.mirror_kinds
    mirrors: dict[str, dict[str, float]] = {}
    views: dict[str, dict[str, float]] = {}
    for key, value in fixed.items():
        owner, _, quantity = key.partition(".")
        of_view = quantity in {"viewpoint_mm", "gain"}
        (views if of_view else mirrors).setdefault(owner, {})[quantity] = value
    for name, given in mirrors.items():
        if name not in kinds:
            article = "an" if name == "upper" else "a"
            return f"{article} {name} mirror is fixed, but this configuration has none"
        reason = _why_kind_conflicts(configuration, name, given)
        if reason is not None:
            return reason
    for view in VIEW_NAMES:
        reason = _why_view_conflicts(configuration, view, views.get(view, {}))
        if reason is not None:
            return reason
    for name, kind in kinds.items():
        if name in VIEW_OF_SINGLE_MIRROR:
            ways = inverse_eccentricities(mirrors.get(name, {}), views.get(VIEW_OF_SINGLE_MIRROR[name], {}))
            for words, q in ways:
                implied = kind_of_single_mirror(q)
                if implied is not kind:
                    return (
                        f"the {name} mirror is {with_article(implied.word)} according to {words}, but in this "
                        f"configuration it is {with_article(kind.word)}"
                    )
    return None


def _why_kind_conflicts(configuration: Configuration, name: str, given: Mapping[str, float]) -> str | None:
    """Why a mirror cannot be the configuration's: it is of another kind, or curved to the other side."""
    kinds = configuration.mirror_kinds
    kind = kinds[name]
    if kind is MirrorKind.PLANE:
        curved = given.keys() & {"radius_mm", "conic"}
        return f"the fixed {name} mirror is curved, but in this configuration it is a plane" if curved else None
    if "conic" in given and kind is not (its := kind_of_conic(given["conic"])):
        return (
            f"the fixed {name} mirror (conic constant {given['conic']:g}) is {with_article(its.word)}, but in this "
            f"configuration it is {with_article(kind.word)}"
        )
    if "radius_mm" not in given:
        return None
    pair_of_ellipsoids = kinds.get("primary") is kinds.get("secondary") is MirrorKind.ELLIPSOID
    signs = radius_signs(name, kind, may_share_focus_below=pair_of_ellipsoids)
    if math.copysign(1, given["radius_mm"]) in signs:
        return None
    return (
        f"the fixed {name} mirror has a radius of {given['radius_mm']:g} mm, but the {kind.word} of this "
        f"configuration needs a {'negative' if -1 in signs else 'positive'} radius"
    )


def _why_view_conflicts(configuration: Configuration, view: ViewName, given: Mapping[str, float]) -> str | None:
    """Why a view cannot be the configuration's: its image would lie on the other side, or its viewpoint below."""
    if "gain" in given:
        signs = {variant.gain_sign(view) for variant in enumerate_variants(configuration)}
        if math.copysign(1, given["gain"]) not in signs:
            word = "negative" if -1 in signs else "positive"
            return f"the fixed gain of the {view} view is {given['gain']:g}, but in this configuration it is {word}"
    if configuration.family == "direct":
        if given.get("viewpoint_mm", 1.0) <= 0:
            return f"the fixed {view} viewpoint lies below the pinhole, but the mirror of this view lies above it"
        if abs(given.get("gain", 0.0)) >= 1:
            return f"the fixed gain of the {view} view is {given['gain']:g}, but a single mirror gives less than 1"
    return None


def _largest_baseline(specification: Specification, baseline: float) -> float:
    """The most that the viewpoints can be apart if the views cover what they must at a baseline, in mm."""
    envelope = specification.asked.envelope
    spans = (_span_deg(specification, baseline, view) for view in reversed(VIEW_NAMES))
    least_slopes = (math.tan(math.radians(max(low, -high, 0.0))) for low, high in spans)
    return envelope.height_mm + sum(least_slopes) * envelope.mirror_diameter_mm / 2.0


def _span_deg(specification: Specification, baseline: float, view: ViewName) -> tuple[float, float]:
    low, high = slopes_at(specification, baseline)[view]
    return math.degrees(math.atan(low)), math.degrees(math.atan(high))


def _can_leave_horizon(spans: list[tuple[float, float]]) -> bool:
    """Whether at some allowed baseline the range lies wholly on one side: both its ends move one way with it."""
    return max(low for low, _ in spans) > 0.0 or min(high for _, high in spans) < 0.0
