"""The judge: a design traced, its record compared, its solids checked, and one verdict on all of it.

Each question has its own module: the record (:mod:`.contradicted_record`), chief rays of each view
(:mod:`.chief_rays`), solids (:mod:`.solids`), the housing (:mod:`.housing`), the light of the full pupil
(:mod:`.light`). A further question adds its sentences to the problems of :func:`judge`.
"""

from __future__ import annotations

import numpy as np

from designer.design import Camera, Design, Interval, View
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.image_law import image_radius, largest_radius_mm
from designer.trace.instrument import build_instrument
from designer.verify.chief_rays import END_INSET_DEG, IMAGE_SAMPLES, judge_view
from designer.verify.contradicted_record import needed_elevations, record_problems, topology_named_by
from designer.verify.coverage import map_image
from designer.verify.housing import housing_problems
from designer.verify.intervals import common, common_width, in_degrees
from designer.verify.light import view_light
from designer.verify.light_verdict import light_problems
from designer.verify.solids import contact_problems, find_rims
from designer.verify.verdict import Verdict, ViewVerdict


def judge(design: Design, *, whole_image: bool = True) -> Verdict:
    """Trace a design and say whether both views see all that is asked of them, and if not, why.

    A design passes when every asked elevation of both views is seen through the intended mirrors, each met first;
    every exit ray passes through the view's viewpoint and obeys its gain; the image zones are disjoint and inside
    the image circle; no two solids touch; the asked rays pass a tube between its ends; and, where the record says how
    sharp the design must be, the light of the full pupil arrives, unmixed and sharp. Nonsense gets problems, never an
    exception.

    Without the ``whole_image`` only rays that are asked for are traced: the same questions decide, five times sooner,
    but what else the camera sees stays unsaid.
    """
    with np.errstate(all="ignore"):
        instrument = build_instrument(design)
        rims = find_rims(design)
        needed = needed_elevations(design) or {}
        asked = {name: _as_asked(view, needed.get(name)) for name, view in design.views.by_name.items()}
        judged = {
            name: judge_view(design, instrument, name, view, rims, whole_image=whole_image)
            for name, view in asked.items()
        }
        upper, lower = judged["upper"], judged["lower"]
        problems = (
            *record_problems(design),
            *upper.problems,
            *lower.problems,
            *_zone_problems(design, upper, lower),
            *contact_problems(design),
            *housing_problems(design, instrument, asked),
            *_lens_problems(design.camera),
        )
        light = view_light(design)
        problems += tuple(light_problems(design, light))
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
        light=light,
    )


def _lens_problems(camera: Camera) -> list[str]:
    """An image circle that the law of the lens does not reach."""
    largest = largest_radius_mm(camera)
    if largest >= camera.image_radius_mm:
        return []
    return [
        f"the lens images nothing beyond {largest:.4g} mm from the centre ({camera.projection} projection), but its "
        f"image circle reaches {camera.image_radius_mm:.4g} mm"
    ]


def _as_asked(view: View, needed: Interval | None) -> View:
    """The view, asked for all that the working volume needs if its record says less."""
    low, high = view.elevation_deg
    if needed is None or not -90.0 < low < high < 90.0 or max(low - needed[0], needed[1] - high) <= END_INSET_DEG:
        return view
    return view.model_copy(update={"elevation_deg": (min(low, needed[0]), max(high, needed[1]))})


def _zone_problems(design: Design, upper: ViewVerdict, lower: ViewVerdict) -> list[str]:
    if upper.zone_psi_deg is None or lower.zone_psi_deg is None:
        return []
    problems = []
    overlap = common_width(upper.zone_psi_deg, lower.zone_psi_deg)
    if overlap > 0.0:
        shared = image_radius(design.camera, np.radians(common(upper.zone_psi_deg, lower.zone_psi_deg)))
        width = (shared[1] - shared[0]) / design.camera.pixel_pitch_mm
        problems.append(f"the image zones of the two views overlap by {width:.4g} px")
    for name, view, zone, other in (
        ("upper", design.views.upper, upper.zone_psi_deg, lower.zone_psi_deg),
        ("lower", design.views.lower, lower.zone_psi_deg, upper.zone_psi_deg),
    ):
        if (view.zone == "outer") != (zone[1] > other[1]):
            problems.append(f"{name} view: its zone is recorded as {view.zone}, but lies on the other side")
    topology = topology_named_by(design)
    traced = "upper_outer" if upper.zone_psi_deg[1] > lower.zone_psi_deg[1] else "upper_inner"
    if topology is not None and topology != traced:
        problems.append(
            f"configuration {design.configuration} is {topology}, but the upper view occupies "
            f"{in_degrees(upper.zone_psi_deg)} at the pinhole and the lower one {in_degrees(lower.zone_psi_deg)}"
        )
    return problems
