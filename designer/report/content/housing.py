"""The housing of a design in a page's columns of facts: its dimensions, and what it does to what is seen through it."""

from __future__ import annotations

from designer.design import VIEW_NAMES, Design
from designer.evaluate.housing import DepthBias, StrutsScore, TubeScore, housing_score
from designer.housing import MATERIALS
from designer.typesetting.markup import number, plain_number
from designer.verify.wall_reflections import wall_reflections

Facts = list[tuple[str, str]]


def housing_groups(design: Design) -> list[tuple[str, Facts]]:
    """One group on the tube or the struts; none for a design without a housing."""
    score = housing_score(design)
    if score is None:
        return []
    return [("Housing", _tube_facts(design, score) if score.kind == "tube" else _strut_facts(score))]


def housing_in_short(design: Design) -> list[tuple[str, Facts]]:
    """The same group without what the design's own page says too."""
    return [(title, facts[:3]) for title, facts in housing_groups(design)]


def _tube_facts(design: Design, score: TubeScore) -> Facts:
    material = MATERIALS.get(design.tube.material if design.tube else "")
    outer, length = score.outer_diameter_mm, score.length_mm
    inner = outer - 2.0 * score.wall_mm
    smears = ", ".join(number(score.smear_mm[name], 2) for name in VIEW_NAMES)
    shifts = [end for name in VIEW_NAMES for end in score.shift_mm[name]]
    near, *others = score.uncorrected_bias
    facts = [
        ("tube", f"⌀{number(outer, 1)}/{number(inner, 1)}, {number(length, 1)} mm long"),
        ("of", f"{material.words if material else 'unknown material'}{_mass(score.mass_g)}"),
        _bias(near),
        *map(_bias, others),
        ("refractive index", plain_number(score.refractive_index)),
        ("rays move axially by", f"{number(min(shifts), 2)} to {number(max(shifts), 2)} mm"),
        ("viewpoints smeared", f"{smears} mm (upper, lower)"),
        ("wall lets through", f"{_span(tuple(100.0 * each for each in score.transmitted), 1)} %, uncoated"),
    ]
    reflected = [
        f"{', '.join(f'{number(low, 0)}° to {number(high, 0)}°' for low, high in ranges)} {name}"
        for name, ranges in wall_reflections(design).items()
        if ranges
    ]
    if reflected:
        facts.append(("far side reflected at", "; ".join(reflected)))
    return facts


def _strut_facts(score: StrutsScore) -> Facts:
    azimuths = ", ".join(f"{plain_number(round(each, 1))}°" for each in score.azimuths_deg)
    blocked = f"{number(score.blocked_deg, 1)}° each, {number(100.0 * score.blocked_share, 1)} % of all"
    return [
        ("struts", f"{score.number} of ⌀{number(score.width_mm, 1)} × {number(score.length_mm, 1)} mm"),
        ("from the axis", f"{number(score.radius_mm, 2)} mm{_mass(score.mass_g)}"),
        ("hidden azimuths", blocked),
        ("at azimuths", azimuths),
    ]


def _mass(mass_g: float | None) -> str:
    return "" if mass_g is None else f", {number(mass_g, 0)} g"


def _bias(bias: DepthBias) -> tuple[str, str]:
    """What the wall does to depth where nothing corrects it."""
    name = f"bias at {plain_number(bias.distance_mm)} mm"
    if bias.bias_mm is None:
        return name, "unknown"
    sigma = "" if bias.bias_in_sigma is None else f" ({number(abs(bias.bias_in_sigma), 1)} σ)"
    return name, f"{number(bias.bias_mm, 2)} mm{sigma} uncorrected"


def _span(ends: tuple[float, ...], decimals: int) -> str:
    low, high = ends[0], ends[-1]
    return f"{number(low, decimals)} to {number(high, decimals)}"
