"""The verdict on a design, by ray tracing alone: what each view sees, what blocks it, whether it has one viewpoint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import Design, Interval, View
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.arrays import Array
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import Instrument, build_instrument
from designer.trace.sequential import trace_sequential
from designer.verify.coverage import (
    SCAN_AZIMUTH,
    ImageZone,
    Run,
    find_runs,
    hull,
    joined,
    map_image,
    single_viewpoint_residuals,
    uncovered,
)
from designer.verify.fans import FanClearance, fan_clearance
from designer.verify.record import needed_elevations, record_problems, topology_named_by
from designer.verify.solids import Rims, contact_problems, find_rims
from designer.verify.traced_views import VIEWPOINT_TOLERANCE_MM as RECORD_TOLERANCE_MM
from designer.verify.traced_views import trace_view

VIEWPOINT_TOLERANCE_MM = 1e-9
GAIN_TOLERANCE = 1e-9
# The ends of the asked range are traced this far inside it: a mirror cut exactly there is not called too small.
END_INSET_DEG = 1e-7
IMAGE_SAMPLES = 385
ASKED_SAMPLES = 257
# Azimuths of the meridians beside the scanned one, none a simple fraction of a turn, and rays on each.
AZIMUTHS_RAD = (1.9, 3.5, 5.3)
AZIMUTH_SAMPLES = 33


@dataclass(frozen=True, slots=True)
class Blockage:
    """Elevations that the mirrors' apertures let through, but something in the way hides.

    ``leg`` says where ("primary to world"), ``element`` what stands there; ``is_asked`` whether it takes away a part
    of the elevations asked of the view.
    """

    leg: str
    element: str
    elevation_deg: Interval
    is_asked: bool


@dataclass(frozen=True, slots=True)
class ViewVerdict:
    """What tracing says of one view.

    ``viewpoint_mm`` is the recorded one, or where the exit rays cross the axis if that is elsewhere.
    ``asked_elevation_deg`` is what is recorded for the view, and what else the working volume needs;
    ``aperture_elevation_deg`` what the mirrors' apertures let through to the whole image, blockage ignored (None:
    nothing); ``seen_elevation_deg`` the ranges seen inside the image circle, each mirror of the path met first;
    ``gaps_deg`` the parts of the asked range that are not seen; ``zone_psi_deg`` the angles at the pinhole that the
    asked range takes, None if part of it is not in the image. Residuals are the largest over the rays that the
    apertures let through: distance of an exit line from the viewpoint, and |tan(psi/2) - gain tan(pi/4 +- phi/2)|
    with phi measured from the exit ray; infinite if there is no such ray. ``clearance_mm`` is the least distance, in
    the meridional plane, of a leg of the asked rays from a rim other than those beside which it starts or ends.
    """

    path: tuple[str, ...]
    viewpoint_mm: float
    asked_elevation_deg: Interval
    aperture_elevation_deg: Interval | None
    seen_elevation_deg: tuple[Interval, ...]
    gaps_deg: tuple[Interval, ...]
    zone_psi_deg: Interval | None
    svp_residual_mm: float
    gain_residual: float
    blockages: tuple[Blockage, ...]
    clearance_mm: float
    clearance_at: str
    problems: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """The tracer's verdict on a design; ``problems`` says in one sentence each why it did not pass.

    ``image`` says what the camera sees from the image centre out to the corner, in rising pinhole angles.
    """

    passed: bool
    problems: tuple[str, ...]
    configuration: str
    baseline_mm: float
    upper: ViewVerdict
    lower: ViewVerdict
    image: tuple[ImageZone, ...]

    @property
    def views(self) -> dict[str, ViewVerdict]:
        """Both views by name."""
        return {"upper": self.upper, "lower": self.lower}

    @property
    def smallest_clearance_mm(self) -> float:
        """The lesser clearance of the two views."""
        return min(self.upper.clearance_mm, self.lower.clearance_mm)

    @property
    def smallest_clearance_at(self) -> str:
        """Which view, leg and rim have the smallest clearance; empty if none was found."""
        return min(self.views.values(), key=lambda view: view.clearance_mm).clearance_at


def judge(design: Design, *, whole_image: bool = True) -> Verdict:
    """Trace a design and say whether both views see all that is asked of them, and if not, why.

    A design passes when every asked elevation of both views is seen through the intended mirrors, each met first;
    every exit ray passes through the view's viewpoint and obeys its gain; the image zones are disjoint and inside
    the image circle; and no two solids touch. Nonsense gets problems, never an exception.

    Without the ``whole_image`` only rays that are asked for are traced: the same questions decide, five times sooner,
    but what else the camera sees stays unsaid.
    """
    with np.errstate(all="ignore"):
        instrument = build_instrument(design)
        rims = find_rims(design)
        needed = needed_elevations(design) or {}
        upper, lower = (
            _judge_view(design, instrument, name, _as_asked(view, needed.get(name)), rims, whole_image)
            for name, view in (("upper", design.views.upper), ("lower", design.views.lower))
        )
        problems = (
            *record_problems(design),
            *upper.problems,
            *lower.problems,
            *_zone_problems(design, upper, lower),
            *contact_problems(design),
        )
        image = (
            map_image(instrument, np.linspace(0.0, widest_pinhole_angle(design), IMAGE_SAMPLES)) if whole_image else []
        )
    return Verdict(
        passed=not problems,
        problems=problems,
        configuration=design.configuration,
        baseline_mm=upper.viewpoint_mm - lower.viewpoint_mm,
        upper=upper,
        lower=lower,
        image=tuple(image),
    )


def _as_asked(view: View, needed: Interval | None) -> View:
    """The view, asked for all that the working volume needs if its record says less."""
    low, high = view.elevation_deg
    if needed is None or not -90.0 < low < high < 90.0 or max(low - needed[0], needed[1] - high) <= END_INSET_DEG:
        return view
    return view.model_copy(update={"elevation_deg": (min(low, needed[0]), max(high, needed[1]))})


def _judge_view(
    design: Design, instrument: Instrument, name: str, view: View, rims: Rims, whole_image: bool
) -> ViewVerdict:
    path = instrument.path(view.path)
    low, high = view.elevation_deg
    widest = widest_pinhole_angle(design)
    circle = float(np.arctan2(design.camera.image_radius_mm, design.camera.focal_length_mm))
    ends = pinhole_angles(instrument, path, np.radians([low + END_INSET_DEG, high - END_INSET_DEG]), widest)
    is_reached = bool(np.isfinite(ends).all())
    asked_psi = np.linspace(ends.min(), ends.max(), ASKED_SAMPLES) if is_reached else np.empty(0)
    beside = np.linspace(0.0, widest, IMAGE_SAMPLES) if whole_image or not is_reached else np.empty(0)
    psi = np.unique(np.concatenate([beside, asked_psi]))

    runs = find_runs(instrument, path, psi, circle)
    seen = joined([run.elevation_deg for run in runs if run.is_seen], END_INSET_DEG)
    gaps = uncovered((low, high), seen, 2.0 * END_INSET_DEG)
    blockages = _blockages(instrument, view, runs)
    around_psi, azimuths = _other_meridians(asked_psi)
    residuals = single_viewpoint_residuals(
        instrument,
        path,
        view.viewpoint_mm,
        view.gain,
        view.sense,
        np.concatenate([psi, around_psi]),
        np.concatenate([np.full(psi.size, SCAN_AZIMUTH), azimuths]),
    )
    fan = fan_clearance(instrument, path, asked_psi, rims)

    problems = [
        f"no ray in the image leaves at {elevation:.4g} deg, an end of the asked range"
        for elevation, angle in zip((low, high), ends, strict=True)
        if np.isnan(angle)
    ]
    problems += [
        f"{blockage.leg}: {blockage.element} blocks {_span(_common(blockage.elevation_deg, (low, high)))}"
        for blockage in blockages
        if blockage.is_asked
    ]
    problems += _aperture_problems(design, instrument, path, view, asked_psi)
    problems += [f"{_span(gap)} is not seen" for gap in gaps]
    if is_reached:
        problems += _camera_problems(design, float(ends.max()), circle)
        if not gaps:
            problems += _azimuth_problems(instrument, path, around_psi, azimuths)
            problems += [f"{_leg_name(view, leg)}: the {rim} stands between the rays" for leg, rim in fan.obstructions]
    is_as_recorded = residuals[0] < VIEWPOINT_TOLERANCE_MM and residuals[1] < GAIN_TOLERANCE
    traced = None if is_as_recorded else trace_view(instrument, path, widest)
    if not residuals[0] < VIEWPOINT_TOLERANCE_MM:
        crossing = f"; they cross the axis at {traced.viewpoint_mm:.9g} mm" if traced else ""
        problems.append(
            f"exit rays miss the viewpoint ({view.viewpoint_mm:.9g} mm) by up to {residuals[0]:.3g} mm{crossing}"
        )
    if not residuals[1] < GAIN_TOLERANCE:
        found = f"; its mirrors make it {traced.gain:.9g}, {traced.sense}" if traced else ""
        problems.append(
            f"the traced gain is off its record ({view.gain:.9g}, {view.sense}) by up to {residuals[1]:.3g} in "
            f"tan(psi/2){found}"
        )

    zone = (float(np.degrees(ends.min())), float(np.degrees(ends.max()))) if is_reached else None
    return ViewVerdict(
        path=tuple(view.path),
        viewpoint_mm=traced.viewpoint_mm if traced and residuals[0] > RECORD_TOLERANCE_MM else view.viewpoint_mm,
        asked_elevation_deg=(low, high),
        aperture_elevation_deg=hull([run.elevation_deg for run in runs]),
        seen_elevation_deg=tuple(seen),
        gaps_deg=tuple(gaps),
        zone_psi_deg=zone,
        svp_residual_mm=residuals[0],
        gain_residual=residuals[1],
        blockages=blockages,
        clearance_mm=fan.distance_mm,
        clearance_at=_where(name, view, fan),
        problems=tuple(f"{name} view: {problem}" for problem in problems),
    )


def _blockages(instrument: Instrument, view: View, runs: list[Run]) -> tuple[Blockage, ...]:
    return tuple(
        Blockage(
            _leg_name(view, run.leg),
            instrument.elements[run.element],
            run.elevation_deg,
            _common_width(run.elevation_deg, view.elevation_deg) > 2.0 * END_INSET_DEG,
        )
        for run in runs
        if run.element >= 0
    )


def _other_meridians(asked_psi: Array) -> tuple[Array, Array]:
    """Angles psi and azimuths of asked rays, both ends among them, off the scanned meridian."""
    chosen = asked_psi[:: (ASKED_SAMPLES - 1) // (AZIMUTH_SAMPLES - 1)]
    return np.tile(chosen, len(AZIMUTHS_RAD)), np.repeat(AZIMUTHS_RAD, chosen.size)


def _aperture_problems(
    design: Design, instrument: Instrument, path: tuple[int, ...], view: View, psi: Array
) -> list[str]:
    """Mirrors that do not reach as far, inwards or outwards, as the asked rays need."""
    if not psi.size:
        return []
    trace = trace_sequential(instrument, path, pinhole_directions(psi[[0, -1]], SCAN_AZIMUTH), apertures=False)
    problems = []
    for mirror_name, hit in zip(view.path, trace.hits, strict=True):
        mirror = design.mirror(mirror_name)
        needed = np.hypot(hit[:, 0], hit[:, 1])
        if needed.max() > mirror.outer_radius_mm:
            problems.append(
                f"{mirror_name} ends at radius {mirror.outer_radius_mm:.7g} mm; "
                f"the asked rays meet it out to {needed.max():.7g} mm"
            )
        if needed.min() < mirror.inner_radius_mm:
            problems.append(
                f"{mirror_name} begins at radius {mirror.inner_radius_mm:.7g} mm; "
                f"the asked rays meet it in to {needed.min():.7g} mm"
            )
    return problems


def _camera_problems(design: Design, widest_asked: float, circle: float) -> list[str]:
    camera = design.camera
    problems = []
    if np.degrees(widest_asked - circle) > END_INSET_DEG:
        focal_px = camera.focal_length_mm / camera.pixel_pitch_mm
        beyond = focal_px * (np.tan(widest_asked) - np.tan(circle))
        problems.append(f"its image zone reaches {beyond:.4g} px beyond the image circle")
    excess = camera.lens_front_mm * np.tan(widest_asked) - camera.lens_radius_mm
    if excess > 0.0:
        problems.append(f"the lens barrel cuts into its own rays by {excess:.4g} mm at the lens front")
    return problems


def _azimuth_problems(instrument: Instrument, path: tuple[int, ...], psi: Array, azimuths: Array) -> list[str]:
    report = compare_with_path(trace_first_hits(instrument, pinhole_directions(psi, azimuths)), path)
    spoiled = report.status != Status.OK
    if not spoiled.any():
        return []
    return [f"{int(spoiled.sum())} of {psi.size} asked rays at other azimuths do not get through"]


def _zone_problems(design: Design, upper: ViewVerdict, lower: ViewVerdict) -> list[str]:
    if upper.zone_psi_deg is None or lower.zone_psi_deg is None:
        return []
    problems = []
    overlap = _common_width(upper.zone_psi_deg, lower.zone_psi_deg)
    if overlap > 0.0:
        common = np.tan(np.radians(_common(upper.zone_psi_deg, lower.zone_psi_deg)))
        width = (common[1] - common[0]) * design.camera.focal_length_mm / design.camera.pixel_pitch_mm
        problems.append(f"the image zones of the two views overlap by {width:.4g} px")
    for name, view, zone, other in (
        ("upper", design.views.upper, upper.zone_psi_deg, lower.zone_psi_deg),
        ("lower", design.views.lower, lower.zone_psi_deg, upper.zone_psi_deg),
    ):
        if (view.zone == "outer") != (zone[1] > other[1]):
            problems.append(f"{name} view: its zone is called {view.zone}, but lies on the other side")
    topology = topology_named_by(design)
    traced = "upper_outer" if upper.zone_psi_deg[1] > lower.zone_psi_deg[1] else "upper_inner"
    if topology is not None and topology != traced:
        problems.append(
            f"configuration {design.configuration} is {topology}, but the upper view takes "
            f"{_span(upper.zone_psi_deg)} at the pinhole and the lower one {_span(lower.zone_psi_deg)}"
        )
    return problems


def _leg_name(view: View, leg: int) -> str:
    stations = ("pinhole", *view.path, "world")
    return f"{stations[leg]} to {stations[leg + 1]}"


def _where(name: str, view: View, fan: FanClearance) -> str:
    return f"{name} view, {_leg_name(view, fan.leg)}, {fan.rim}" if fan.leg >= 0 else ""


def _common(first: Interval, second: Interval) -> Interval:
    return max(first[0], second[0]), min(first[1], second[1])


def _common_width(first: Interval, second: Interval) -> float:
    low, high = _common(first, second)
    return high - low


def _span(interval: Interval) -> str:
    low, high = interval
    digits = 2 if high - low >= 0.02 else 9
    return f"{low:.{digits}f} to {high:.{digits}f} deg"


def describe(verdict: Verdict) -> str:
    """The verdict as plain text for a terminal, several lines."""
    lines = [
        f"{verdict.configuration}: {'passed' if verdict.passed else 'NOT passed'}",
        f"baseline {verdict.baseline_mm:.3f} mm",
    ]
    for name, view in verdict.views.items():
        aperture = "nothing" if view.aperture_elevation_deg is None else _span(view.aperture_elevation_deg)
        seen = ", ".join(_span(run) for run in view.seen_elevation_deg) or "nothing"
        zone = "not in the image" if view.zone_psi_deg is None else _span(view.zone_psi_deg) + " at the pinhole"
        lines += [
            f"{name} view: pinhole to {', '.join(view.path)}, world",
            f"  asked      {_span(view.asked_elevation_deg)}",
            f"  apertures  {aperture}",
            f"  seen       {seen}",
            f"  zone       {zone}",
            f"  viewpoint  missed by at most {view.svp_residual_mm:.2g} mm, gain law by {view.gain_residual:.2g}",
            f"  clearance  {view.clearance_mm:.3f} mm ({view.clearance_at})" if view.clearance_at else "",
        ]
        lines += [
            f"  blocked    {_span(blockage.elevation_deg)} by {blockage.element}, {blockage.leg}"
            + ("" if blockage.is_asked else " (not asked for)")
            for blockage in view.blockages
        ]
    lines += ["image, by angle from the axis at the pinhole:"]
    lines += [
        f"  {_span(zone.psi_deg)}: {', '.join(zone.stations)}{' (blocked)' if zone.is_blocked else ''}"
        for zone in verdict.image
    ]
    lines += ["problems:", *(f"  {problem}" for problem in verdict.problems)] if verdict.problems else []
    return "\n".join(line for line in lines if line)
