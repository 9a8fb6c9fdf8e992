"""What the mirrors make of each view, whatever the record says: viewpoint, gain and sense, measured on traced rays.

A hand-edited record may name a viewpoint that its mirrors do not have. What is computed from views (the score, above
all) should then come from the mirrors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from designer.design import Design, PerView, Sense, View, Zone
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.arrays import Array
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import Instrument, build_instrument
from designer.trace.sequential import trace_sequential
from designer.verify.contradicted_record import BASELINE_TOLERANCE_MM
from designer.verify.coverage import SCAN_AZIMUTH

SAMPLES = 385
# Smaller disagreements are roundings of published digits: the record is believed.
VIEWPOINT_TOLERANCE_MM = 1e-3
GAIN_TOLERANCE = 1e-4
# Rays that cross the axis farther apart than this have no single viewpoint.
SPREAD_TOLERANCE_MM = 1e-2


@dataclass(frozen=True, slots=True)
class TracedView:
    """A view as its mirrors make it: medians over the rays that the apertures let through to the whole image.

    ``crossings_mm`` are the lowest and the highest point at which an exit line crosses the axis.
    """

    viewpoint_mm: float
    crossings_mm: tuple[float, float]
    gain: float
    sense: Sense


def trace_view(instrument: Instrument, path: Sequence[int], widest: float) -> TracedView | None:
    """Viewpoint, gain and sense by rays at pinhole angles up to ``widest`` (rad); None if none gets through."""
    sent = pinhole_directions(np.linspace(0.0, widest, SAMPLES), SCAN_AZIMUTH)
    trace = trace_sequential(instrument, path, sent)
    through = trace.missed < 0
    across = np.array([np.cos(SCAN_AZIMUTH), np.sin(SCAN_AZIMUTH), 0.0])
    leaving, start = trace.direction[through], trace.point[through]
    with np.errstate(all="ignore"):
        crossing = start[:, 2] - (start @ across) * leaving[:, 2] / (leaving @ across)
        half_psi = np.hypot(sent[through, 0], sent[through, 1]) / (1.0 + sent[through, 2])
        side = np.sign(leaving @ across)
        elevation = elevation_angles(leaving)
        gains = {
            "direct": half_psi / (side * np.tan(np.pi / 4.0 + elevation / 2.0)),
            "folded": half_psi / (side * np.tan(np.pi / 4.0 - elevation / 2.0)),
        }
    usable = np.isfinite(crossing) & np.isfinite(gains["direct"]) & np.isfinite(gains["folded"])
    if np.sum(usable) < 2:
        return None
    crossing = crossing[usable]
    sense: Sense = "direct" if _spread(gains["direct"][usable]) <= _spread(gains["folded"][usable]) else "folded"
    return TracedView(
        viewpoint_mm=float(np.median(crossing)),
        crossings_mm=(float(crossing.min()), float(crossing.max())),
        gain=float(np.median(gains[sense][usable])),
        sense=sense,
    )


def as_traced(design: Design) -> tuple[Design, list[str]]:
    """The design with views and baseline as its mirrors make them, and a sentence for each number that this changes.

    Numbers that agree with the mirrors to the tolerances above stay as recorded, and so does a view whose mirrors let
    nothing through. ``upper`` is the view with the higher viewpoint afterwards. Elevation ranges are kept.
    """
    instrument = build_instrument(design)
    widest = widest_pinhole_angle(design)
    said: list[str] = []
    traced = {
        name: _as_traced(view, f"views.{name}", trace_view(instrument, instrument.path(view.path), widest), said)
        for name, view in design.views.by_name.items()
    }
    upper, lower = traced["upper"], traced["lower"]
    if upper.viewpoint_mm < lower.viewpoint_mm:
        said.append(
            f"views.upper has its viewpoint at {upper.viewpoint_mm:.9g} mm, below that of views.lower at "
            f"{lower.viewpoint_mm:.9g} mm: the two views are interchanged"
        )
        upper, lower = lower, upper
    baseline = upper.viewpoint_mm - lower.viewpoint_mm
    if abs(design.baseline_mm - baseline) <= BASELINE_TOLERANCE_MM:
        baseline = design.baseline_mm
    else:
        said.append(
            f"baseline_mm is recorded as {design.baseline_mm:.9g}, but the viewpoints lie {baseline:.9g} mm apart"
        )
    reached = PerView(upper=_half_psi(upper), lower=_half_psi(lower))
    zones: PerView[Zone]
    if reached.upper > reached.lower:
        zones = PerView(upper="outer", lower="inner")
    else:
        zones = PerView(upper="inner", lower="outer")
    if zones != PerView(upper=upper.zone, lower=lower.zone) and reached.upper != reached.lower:
        said.append(
            f"zone is recorded as {upper.zone} for the upper and {lower.zone} for the lower view, but the upper one "
            f"occupies the {zones.upper} and the lower one the {zones.lower} part of the image"
        )
        upper = upper.model_copy(update={"zone": zones.upper})
        lower = lower.model_copy(update={"zone": zones.lower})
    views = design.views.model_copy(update={"upper": upper, "lower": lower})
    return design.model_copy(update={"views": views, "baseline_mm": baseline}) if said else design, said


def _as_traced(view: View, key: str, traced: TracedView | None, said: list[str]) -> View:
    if traced is None:
        said.append(f"{key}: its mirrors transmit no ray of the image, so its recorded values cannot be compared")
        return view
    update: dict[str, Any] = {}
    low, high = traced.crossings_mm
    if high - low > SPREAD_TOLERANCE_MM:
        said.append(
            f"{key}: its rays cross the axis between {low:.6g} and {high:.6g} mm: there is no single viewpoint, and "
            f"the values are those of its middle ray"
        )
    if abs(traced.viewpoint_mm - view.viewpoint_mm) > VIEWPOINT_TOLERANCE_MM:
        said.append(
            f"{key}.viewpoint_mm is recorded as {view.viewpoint_mm:.9g}, but the rays that its mirrors reflect cross "
            f"the axis at {traced.viewpoint_mm:.9g} mm"
        )
        update["viewpoint_mm"] = traced.viewpoint_mm
    if traced.sense != view.sense:
        said.append(f"{key}.sense is recorded as {view.sense}, but its mirrors give {traced.sense}")
        update["sense"] = traced.sense
    if abs(traced.gain - view.gain) > GAIN_TOLERANCE * abs(traced.gain):
        said.append(f"{key}.gain is recorded as {view.gain:.9g}, but its mirrors give {traced.gain:.9g}")
        update["gain"] = traced.gain
    return view.model_copy(update=update) if update else view


def _half_psi(view: View) -> float:
    """Absolute tan(psi/2) of the middle of a view's elevations."""
    middle = float(np.radians(sum(view.elevation_deg) / 2.0))
    sign = 1.0 if view.sense == "direct" else -1.0
    return float(abs(view.gain * np.tan(np.pi / 4.0 + sign * middle / 2.0)))


def _spread(gains: Array) -> float:
    """How far gains that should all be one differ, in parts of their median."""
    return float(np.ptp(gains) / abs(np.median(gains)))
