"""The judge's questions, put to a comparator about one axis: first hits, clearances, the light of the full pupil.

What :func:`designer.verify.judge.judge` asks of a design record, but for what presumes single viewpoints.
"""

from __future__ import annotations

import numpy as np

from designer.comparators.asked import Asked
from designer.comparators.coaxial import Coaxial, PlacedView
from designer.comparators.head import Head
from designer.comparators.zones import zone_of
from designer.trace.arrays import Array
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.image_law import stretches
from designer.trace.instrument import Instrument, assemble_instrument
from designer.trace.pencils import DISC_RMS_PER_DIAMETER, Bundles, bundles_about, chief_rays_at, pupil_places
from designer.verify.coverage import SCAN_AZIMUTH
from designer.verify.fans import fan_clearance
from designer.verify.light import RINGS, arriving_share, other_view_share
from designer.verify.light_verdict import BLUR_TOLERANCE, BLUR_TOLERANCE_PX, MOST_MIXED
from designer.verify.solids import contact_problems, find_rims

RAYS = 129
# Clearances of chief rays may fall short by what the width of the light is approximated by.
CLEARANCE_TOLERANCE_MM = 0.01


def problems_of(asked: Asked, built: Coaxial, border: bool = False) -> list[str]:
    """One sentence for everything that the tracer finds wrong; none if the comparator does what it should.

    ``border`` says that both mirrors are of one piece and so may touch.
    """
    found: list[str] = []
    with np.errstate(all="ignore"):
        for head in built.heads:
            if not border:
                found += contact_problems(head)
        for name, placed in built.views.items():
            head = built.heads[placed.head]
            instrument = assemble_instrument(head.mirrors, head.camera)
            found += [f"{name} view: {problem}" for problem in _of_view(asked, built, head, instrument, placed, border)]
    return found


def _of_view(
    asked: Asked, built: Coaxial, head: Head, instrument: Instrument, placed: PlacedView, border: bool
) -> list[str]:
    path = instrument.path((placed.mirror,))
    psi = zone_of(placed.view, asked.volume, built.rig.middle_mm, RAYS).psi
    trace = trace_first_hits(instrument, pinhole_directions(psi, SCAN_AZIMUTH))
    lost = int(np.sum(compare_with_path(trace, path).status != Status.OK))
    problems = [f"{lost} of {RAYS} required rays are lost"] if lost else []
    fan = fan_clearance(instrument, path, psi, find_rims(head))
    keep = asked.requirement.manufacture.clearance_mm - CLEARANCE_TOLERANCE_MM
    # Where both mirrors are of one piece the border stands beside both fans, an edge margin away.
    if fan.distance_mm < keep and not border:
        problems.append(f"only {fan.distance_mm:.3g} mm from the {fan.rim}")
    problems += [f"the {rim} lies between the rays" for _, rim in fan.obstructions]
    ends = psi[[0, RAYS // 2, -1]]
    places = pupil_places(head.camera.pupil_radius_mm, RINGS)
    chief = chief_rays_at(instrument, path, ends)
    bundles = bundles_about(instrument, path, chief, np.array(asked.volume.distances, dtype=float), places)
    return [
        *problems,
        *_light_problems(asked, instrument, path, bundles),
        *_mixing_problems(built, head, instrument, placed, ends[[0, -1]], places),
        *_blur_problems(asked, head, placed, bundles),
    ]


def _light_problems(asked: Asked, instrument: Instrument, path: tuple[int, ...], bundles: Bundles) -> list[str]:
    arrives, stopped_by = arriving_share(instrument, path, bundles)
    least = asked.requirement.sharpness.least_light_percent
    place = np.unravel_index(int(np.argmin(arrives)), arrives.shape)
    share = 100.0 * float(arrives[place])
    return [] if share >= least else [f"{share:.0f} % of the light arrives; the rest ends at {stopped_by[place]}"]


def _mixing_problems(
    built: Coaxial, head: Head, instrument: Instrument, placed: PlacedView, ends: Array, places: Array
) -> list[str]:
    others = [each.mirror for each in built.views.values() if each.head == placed.head and each is not placed]
    if not others:
        return []
    camera = head.camera
    reciprocal_focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    paths = instrument.path((placed.mirror,)), instrument.path((others[0],))
    own, other = other_view_share(instrument, *paths, np.tan(ends), places, reciprocal_focus)
    mixed = float(np.nanmax(other / (own + other)))
    return [] if mixed <= MOST_MIXED else [f"{100.0 * mixed:.2g} % of its light comes through the other mirror"]


def _blur_problems(asked: Asked, head: Head, placed: PlacedView, bundles: Bundles) -> list[str]:
    camera = head.camera
    reciprocal_focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    longer = np.maximum(*stretches(camera, bundles.psi))[:, None]
    blur = bundles.rms_radius_mm(camera.focal_length_mm, reciprocal_focus) / DISC_RMS_PER_DIAMETER * longer
    zone = placed.zone
    closed = zone.blur_mm[[0, len(zone.psi) // 2, -1]]
    slack = BLUR_TOLERANCE_PX * camera.pixel_pitch_mm
    # The pencils' blur, the larger of both planes, has been held to the limits; the whole pupil's must not exceed it.
    if np.all(blur <= closed * (1.0 + BLUR_TOLERANCE) + slack):
        return []
    worst = float(np.nanmax(blur - closed)) / camera.pixel_pitch_mm
    return [f"the whole pupil blurs {worst:.2g} px more than close pencils do"]
