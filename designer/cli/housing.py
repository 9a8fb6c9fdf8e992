"""What a housing is and does, as lines for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from designer.design import Interval, ViewName
    from designer.evaluate.housing import DepthBias, StrutsScore, TubeScore


def describe_housing(
    score: TubeScore | StrutsScore | None, reflections: Mapping[ViewName, tuple[Interval, ...]]
) -> list[str]:
    """Lines on a tube, with where its inner wall reflects, or on struts; none for a design without a housing."""
    if score is None:
        return []
    mass = "" if score.mass_g is None else f", {score.mass_g:.4g} g"
    if score.kind == "struts":
        where = ", ".join(f"{azimuth:.4g}" for azimuth in score.azimuths_deg)
        return [
            f"housing: {score.number} struts, {score.width_mm:.4g} mm thick, {score.radius_mm:.4g} mm from the axis, "
            f"{score.length_mm:.4g} mm long{mass}",
            f"  blocked    {score.blocked_deg:.3g} deg of azimuth each, at {where} deg: "
            f"{100.0 * score.blocked_share:.3g} % of all azimuths",
        ]
    lines = [
        f"housing: a tube of {score.outer_diameter_mm:.4g} mm, wall {score.wall_mm:.4g} mm, {score.length_mm:.4g} mm "
        f"long{mass}, refractive index {score.refractive_index:.4g}"
    ]
    for name, (low, high) in score.shift_mm.items():
        lines.append(
            f"  {name} view moves by {low:+.3f} to {high:+.3f} mm along the axis: its viewpoint is smeared over "
            f"{score.smear_mm[name]:.3f} mm"
        )
    lines += ["  epipolar geometry does not change: every chief ray stays in its meridional plane"]
    lines += [f"  depth without correction at {_bias(bias)}" for bias in score.uncorrected_bias]
    lines += ["  `designer stereo` and `designer check` correct it"]
    if score.largest_blur_px is not None:
        lines.append(f"  blur       at most {score.largest_blur_px:.3g} px through the wall")
    least, most = (100.0 * share for share in score.transmitted)
    lines.append(f"  light      {least:.3g} to {most:.3g} % passes the wall, uncoated")
    for name, ranges in reflections.items():
        where = ", ".join(f"{low:.1f} to {high:.1f}" for low, high in ranges)
        if ranges:
            lines.append(
                f"  risk       {name} view, at {where} deg: the inner wall reflects the far side (azimuth + 180 deg, "
                f"same elevation), about {100.0 - most:.2g} % as bright"
            )
    return lines


def _bias(bias: DepthBias) -> str:
    if bias.bias_mm is None:
        return f"{bias.distance_mm:.4g} mm: unknown"
    sigma = "" if bias.bias_in_sigma is None else f" ({abs(bias.bias_in_sigma):.3g} sigma)"
    return f"{bias.distance_mm:.4g} mm: {bias.bias_mm:+.3f} mm{sigma}"
