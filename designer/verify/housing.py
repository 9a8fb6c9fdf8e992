"""The housing judged: a tube that the light of both views passes between its ends, and clear of every solid.

Lengths in mm, angles in radians unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.design import Design, View, ViewName
from designer.housing import Tube
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.bundles import pinhole_directions
from designer.trace.housing import refract
from designer.trace.instrument import Instrument
from designer.trace.sequential import trace_sequential
from designer.verify.coverage import SCAN_AZIMUTH
from designer.verify.solids import Section, between, contact, solid_sections

# Elevations traced, the ends among them: the height at the wall rises with elevation all along.
ELEVATIONS = 33
# Light this near to an end of the tube counts as passing: sizes may have been typed in with a few decimals.
END_TOLERANCE_MM = 1e-3


def housing_problems(design: Design, instrument: Instrument, views: Mapping[ViewName, View]) -> list[str]:
    """One sentence for each solid that the housing touches, and each view whose asked light passes an end of a tube.

    ``views`` are the views by name, with the elevations that are asked of them.
    """
    housing = design.housing
    if housing is None:
        return []
    ring = Section(
        f"the {housing.kind}",
        housing.inner_radius_mm,
        housing.outer_radius_mm,
        between(housing.low_mm, housing.high_mm),
    )
    problems = [said for solid in solid_sections(design) if (said := contact(ring, solid)) is not None]
    problems += [
        f"{mirror.name} reaches to radius {mirror.outer_radius_mm:.4g} mm, beyond the {housing.kind} about the mirrors "
        f"({housing.inner_radius_mm:.4g} mm)"
        for mirror in design.mirrors
        if mirror.outer_radius_mm > housing.inner_radius_mm and not any(mirror.name in said for said in problems)
    ]
    if isinstance(housing, Tube):
        for name, view in views.items():
            problems += _end_problems(design, instrument, housing, name, view)
    return problems


def _end_problems(design: Design, instrument: Instrument, tube: Tube, name: str, view: View) -> list[str]:
    """By how much chief rays of the asked elevations pass below or above the tube."""
    elevations = np.radians(np.linspace(*view.elevation_deg, ELEVATIONS))
    path = instrument.path(view.path)
    psi = pinhole_angles(instrument, path, elevations, widest_pinhole_angle(design))
    trace = trace_sequential(instrument, path, pinhole_directions(psi[np.isfinite(psi)], SCAN_AZIMUTH), apertures=False)
    through = refract(tube, trace.point, trace.direction)
    heights = np.stack([through.at_inner[:, 2], through.at_outer[:, 2]])
    heights = heights[:, np.isfinite(heights).all(axis=0)]
    if not heights.size:
        return []
    below, above = tube.low_mm - heights.min(), heights.max() - tube.high_mm
    return [
        f"{name} view: the required rays pass {by:.4g} mm {where} of the tube"
        for by, where in ((below, "below the lower end"), (above, "above the upper end"))
        if by > END_TOLERANCE_MM
    ]
