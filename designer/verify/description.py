"""The verdict as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.verify.intervals import in_degrees
from designer.verify.light import ViewLight
from designer.verify.verdict import Blockage, Verdict, ViewVerdict


def describe(verdict: Verdict, as_built: Sequence[str] = ()) -> str:
    """The verdict as plain text, several lines: both views, the image from its centre outwards, the problems.

    ``as_built`` are the reasons to reject the sensor that was built, if there are any.
    """
    rejected = f" as designed; as built: rejected: {'; '.join(as_built)}" if as_built else ""
    lines = [
        f"{verdict.configuration}: {'passed' if verdict.passed else 'NOT passed'}{rejected}",
        f"baseline {verdict.baseline_mm:.3f} mm",
    ]
    for name, view in verdict.views.items():
        lines += [*_view_lines(name, view), *_light_lines(verdict.light[name])]
    lines += ["image, by angle from the axis at the pinhole:"]
    lines += [
        f"  {in_degrees(zone.psi_deg)}: {', '.join(zone.stations)}{' (blocked)' if zone.is_blocked else ''}"
        for zone in verdict.image
    ]
    lines += ["problems:", *(f"  {problem}" for problem in verdict.problems)] if verdict.problems else []
    return "\n".join(lines)


def _view_lines(name: str, view: ViewVerdict) -> list[str]:
    aperture = "nothing" if view.aperture_elevation_deg is None else in_degrees(view.aperture_elevation_deg)
    seen = ", ".join(in_degrees(run) for run in view.seen_elevation_deg) or "nothing"
    zone = "not in the image" if view.zone_psi_deg is None else in_degrees(view.zone_psi_deg) + " at the pinhole"
    lines = [
        f"{name} view: pinhole to {', '.join(view.path)}, world",
        f"  required   {in_degrees(view.asked_elevation_deg)}",
        f"  apertures  {aperture}",
        f"  seen       {seen}",
        f"  zone       {zone}",
        f"  viewpoint  missed by at most {view.svp_residual_mm:.2g} mm, gain law by {view.gain_residual:.2g}",
    ]
    if view.clearance_at:
        lines.append(f"  clearance  {view.clearance_mm:.3f} mm ({view.clearance_at})")
    return lines + [_blockage_line(blockage) for blockage in view.blockages]


def _light_lines(light: ViewLight) -> list[str]:
    """Full pupil: the least light, the largest blur, the other view's light."""
    low, high = light.elevations_deg[0], light.elevations_deg[-1]
    lowest, highest = (100.0 * float(np.min(light.arrives[end])) for end in (0, -1))
    mixed = 100.0 * float(np.max([light.mixed_in_zone, *light.mixed_at_ends]))
    return [
        f"  light      {lowest:.0f} % of the pupil at {low:.4g} deg, {highest:.0f} % at {high:.4g} deg; "
        + ("mixing unknown" if np.isnan(mixed) else f"{mixed:.2g} % from the other view"),
        "  blur       "
        + (
            "unknown: not all of the light arrives"
            if np.isnan(light.largest_blur_px)
            else f"at most {light.largest_blur_px:.3g} px, {np.max(light.blur_deg):.3g} deg in the scene"
        ),
    ]


def _blockage_line(blockage: Blockage) -> str:
    where = f"  blocked    {in_degrees(blockage.elevation_deg)} by {blockage.element}, {blockage.leg}"
    return where if blockage.is_asked else f"{where} (outside the required range)"
