"""One view judged by its chief rays, those through the pinhole: what is seen, what blocks it, where the rays come from.

Light has no width here. Lengths in mm, angles in radians unless a name says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import Design, Interval, View, ViewName
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.arrays import Array
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.image_law import image_radius, is_perspective, pinhole_angle
from designer.trace.instrument import Instrument
from designer.trace.sequential import trace_sequential
from designer.verify.coverage import SCAN_AZIMUTH, AngleRun, find_runs, single_viewpoint_residuals
from designer.verify.fans import FanClearance, fan_clearance
from designer.verify.intervals import common, common_width, hull, in_degrees, joined, uncovered
from designer.verify.solids import Rims
from designer.verify.traced_views import VIEWPOINT_TOLERANCE_MM as RECORD_TOLERANCE_MM
from designer.verify.traced_views import TracedView, trace_view
from designer.verify.verdict import Blockage, ViewVerdict

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
class _AskedRays:
    """The chief rays that the asked elevations take.

    ``ends`` (2,) are the pinhole angles of the lowest and the highest elevation, NaN where no ray of the image leaves
    at it. ``psi`` are angles from one end to the other, rising; none unless both ends are reached.
    """

    ends: Array
    psi: Array

    @property
    def are_in_image(self) -> bool:
        return self.psi.size > 0

    @property
    def zone_psi_deg(self) -> Interval | None:
        if not self.are_in_image:
            return None
        return float(np.degrees(self.ends.min())), float(np.degrees(self.ends.max()))


@dataclass(frozen=True, slots=True)
class _Residuals:
    """Largest distance of an exit line from the recorded viewpoint, and deviation from the recorded gain law.

    ``traced`` is the view as its mirrors make it, if that is not what is recorded and any ray gets through.
    """

    viewpoint_mm: float
    gain: float
    traced: TracedView | None


def judge_view(
    design: Design, instrument: Instrument, name: ViewName, view: View, rims: Rims, *, whole_image: bool
) -> ViewVerdict:
    """Trace the chief rays of a view and say what it sees of the elevations asked of it, and if not all, why.

    ``view`` carries the asked elevations; ``whole_image`` says whether rays that are not asked for are traced too.
    """
    path, widest = instrument.path(view.path), widest_pinhole_angle(design)
    circle = float(pinhole_angle(design.camera, design.camera.image_radius_mm))
    asked = _aim_at(view.elevation_deg, instrument, path, widest)
    scanned = _scanned_angles(asked, widest, whole_image)
    meridians = _other_meridians(asked.psi)

    runs = find_runs(instrument, path, scanned, circle)
    seen = joined([run.elevation_deg for run in runs if run.is_seen], END_INSET_DEG)
    gaps = uncovered(view.elevation_deg, seen, 2.0 * END_INSET_DEG)
    blockages = _blockages(instrument, view, runs)
    residuals = _residuals(instrument, path, view, scanned, meridians, widest)
    fan = fan_clearance(instrument, path, asked.psi, rims)

    problems = [
        *_end_problems(view, asked),
        *_blockage_problems(view, blockages),
        *_aperture_problems(design, instrument, path, view, asked.psi),
        *(f"{in_degrees(gap)} is not seen" for gap in gaps),
        *(_camera_problems(design, float(asked.ends.max()), circle) if asked.are_in_image else ()),
        # With gaps, what they leave has been said.
        *(_passage_problems(instrument, path, view, meridians, fan) if asked.are_in_image and not gaps else ()),
        *_viewpoint_problems(view, residuals),
    ]
    is_elsewhere = residuals.traced is not None and residuals.viewpoint_mm > RECORD_TOLERANCE_MM
    return ViewVerdict(
        path=tuple(view.path),
        viewpoint_mm=residuals.traced.viewpoint_mm if residuals.traced and is_elsewhere else view.viewpoint_mm,
        asked_elevation_deg=view.elevation_deg,
        aperture_elevation_deg=hull([run.elevation_deg for run in runs]),
        seen_elevation_deg=tuple(seen),
        gaps_deg=tuple(gaps),
        zone_psi_deg=asked.zone_psi_deg,
        svp_residual_mm=residuals.viewpoint_mm,
        gain_residual=residuals.gain,
        blockages=blockages,
        clearance_mm=fan.distance_mm,
        clearance_at=f"{name} view, {_leg_name(view, fan.leg)}, {fan.rim}" if fan.leg >= 0 else "",
        problems=tuple(f"{name} view: {problem}" for problem in problems),
    )


def _aim_at(elevation_deg: Interval, instrument: Instrument, path: tuple[int, ...], widest: float) -> _AskedRays:
    low, high = elevation_deg
    ends = pinhole_angles(instrument, path, np.radians([low + END_INSET_DEG, high - END_INSET_DEG]), widest)
    are_reached = bool(np.isfinite(ends).all())
    return _AskedRays(ends, np.linspace(ends.min(), ends.max(), ASKED_SAMPLES) if are_reached else np.empty(0))


def _scanned_angles(asked: _AskedRays, widest: float, whole_image: bool) -> Array:
    """Rising pinhole angles to scan: the asked ones, and the whole image if that is wanted or the asked ones fail."""
    needs_image = whole_image or not asked.are_in_image
    image = np.linspace(0.0, widest, IMAGE_SAMPLES) if needs_image else np.empty(0)
    return np.unique(np.concatenate([image, asked.psi]))


def _other_meridians(asked_psi: Array) -> tuple[Array, Array]:
    """Angles psi and azimuths of asked rays, both ends among them, off the scanned meridian."""
    chosen = asked_psi[:: (ASKED_SAMPLES - 1) // (AZIMUTH_SAMPLES - 1)]
    return np.tile(chosen, len(AZIMUTHS_RAD)), np.repeat(AZIMUTHS_RAD, chosen.size)


def _blockages(instrument: Instrument, view: View, runs: list[AngleRun]) -> tuple[Blockage, ...]:
    return tuple(
        Blockage(
            _leg_name(view, run.leg),
            instrument.elements[run.element],
            run.elevation_deg,
            common_width(run.elevation_deg, view.elevation_deg) > 2.0 * END_INSET_DEG,
        )
        for run in runs
        if run.element >= 0
    )


def _residuals(
    instrument: Instrument,
    path: tuple[int, ...],
    view: View,
    scanned: Array,
    meridians: tuple[Array, Array],
    widest: float,
) -> _Residuals:
    """Viewpoint and gain on the scanned meridian and on others, against the record."""
    psi = np.concatenate([scanned, meridians[0]])
    azimuths = np.concatenate([np.full(scanned.size, SCAN_AZIMUTH), meridians[1]])
    miss, off_law = single_viewpoint_residuals(
        instrument, path, view.viewpoint_mm, view.gain, view.sense, psi, azimuths
    )
    is_as_recorded = miss < VIEWPOINT_TOLERANCE_MM and off_law < GAIN_TOLERANCE
    return _Residuals(miss, off_law, None if is_as_recorded else trace_view(instrument, path, widest))


def _end_problems(view: View, asked: _AskedRays) -> list[str]:
    return [
        f"no ray in the image exits at {elevation:.4g} deg, an end of the required range"
        for elevation, angle in zip(view.elevation_deg, asked.ends, strict=True)
        if np.isnan(angle)
    ]


def _blockage_problems(view: View, blockages: tuple[Blockage, ...]) -> list[str]:
    return [
        f"{blockage.leg}: {blockage.element} blocks {in_degrees(common(blockage.elevation_deg, view.elevation_deg))}"
        for blockage in blockages
        if blockage.is_asked
    ]


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
                f"the required rays reach out to {needed.max():.7g} mm"
            )
        if needed.min() < mirror.inner_radius_mm:
            problems.append(
                f"{mirror_name} begins at radius {mirror.inner_radius_mm:.7g} mm; "
                f"the required rays reach in to {needed.min():.7g} mm"
            )
    return problems


def _camera_problems(design: Design, widest_asked: float, circle: float) -> list[str]:
    camera = design.camera
    problems = []
    if np.degrees(widest_asked - circle) > END_INSET_DEG:
        focal_px = camera.focal_length_mm / camera.pixel_pitch_mm
        beyond = focal_px * (np.tan(widest_asked) - np.tan(circle))
        if not is_perspective(camera):
            beyond = np.diff(image_radius(camera, [circle, widest_asked]))[0] / camera.pixel_pitch_mm
        problems.append(f"its image zone reaches {beyond:.4g} px beyond the image circle")
    excess = camera.lens_front_mm * np.tan(widest_asked) - camera.lens_radius_mm
    if excess > 0.0:
        problems.append(f"the lens barrel cuts off the required rays by {excess:.4g} mm at the lens front")
    return problems


def _passage_problems(
    instrument: Instrument, path: tuple[int, ...], view: View, meridians: tuple[Array, Array], fan: FanClearance
) -> list[str]:
    """What the scanned meridian does not show: asked rays lost at other azimuths, rims between neighbouring rays."""
    return [
        *_azimuth_problems(instrument, path, *meridians),
        *(f"{_leg_name(view, leg)}: the {rim} lies between the rays" for leg, rim in fan.obstructions),
    ]


def _azimuth_problems(instrument: Instrument, path: tuple[int, ...], psi: Array, azimuths: Array) -> list[str]:
    report = compare_with_path(trace_first_hits(instrument, pinhole_directions(psi, azimuths)), path)
    spoiled = report.status != Status.OK
    if not spoiled.any():
        return []
    return [f"{int(spoiled.sum())} of {psi.size} required rays at other azimuths are lost"]


def _viewpoint_problems(view: View, residuals: _Residuals) -> list[str]:
    traced, problems = residuals.traced, []
    # Written so that a residual that is no number fails.
    if not residuals.viewpoint_mm < VIEWPOINT_TOLERANCE_MM:
        crossing = f"; they cross the axis at {traced.viewpoint_mm:.9g} mm" if traced else ""
        problems.append(
            f"exit rays miss the viewpoint ({view.viewpoint_mm:.9g} mm) by up to {residuals.viewpoint_mm:.3g} mm"
            f"{crossing}"
        )
    if not residuals.gain < GAIN_TOLERANCE:
        found = f"; its mirrors give {traced.gain:.9g}, {traced.sense}" if traced else ""
        problems.append(
            f"the traced gain differs from its record ({view.gain:.9g}, {view.sense}) by up to {residuals.gain:.3g} in "
            f"tan(psi/2){found}"
        )
    return problems


def _leg_name(view: View, leg: int) -> str:
    stations = ("pinhole", *view.path, "world")
    return f"{stations[leg]} to {stations[leg + 1]}"
