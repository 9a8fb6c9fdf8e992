"""Where the inner wall of a tube reflects the far side of the scene into a view.

A chief ray of slope m, followed outwards from its viewpoint, meets the wall of radius r at the height z + m r above it.
What the wall reflects goes back inwards, as steep as before, crosses the axis at z + 2 m r and leaves through the
opposite side: the pixel also shows, faintly, what lies there at the same elevation, mirrored in the wall, as if 2 r
farther away. Where a mirror, the lens or the camera's body stands in the way across the tube there is no such image,
but light from that part, which is not followed further.
"""

from __future__ import annotations

import numpy as np

from designer.design import VIEW_NAMES, Design, Interval, ViewName
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.housing import refract
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential

ELEVATIONS = 257


def wall_reflections(design: Design) -> dict[ViewName, tuple[Interval, ...]]:
    """Elevations in degrees of each view at which its tube's inner wall shows the far side; none without a tube.

    By chief rays over the recorded elevations, to a 256th of their range.
    """
    tube = design.tube
    if tube is None:
        return dict.fromkeys(VIEW_NAMES, ())
    instrument = build_instrument(design)
    found: dict[ViewName, tuple[Interval, ...]] = {}
    for name, view in design.views.by_name.items():
        elevations = np.linspace(*view.elevation_deg, ELEVATIONS)
        path = instrument.path(view.path)
        psi = pinhole_angles(instrument, path, np.radians(elevations), widest_pinhole_angle(design))
        known = np.isfinite(psi)
        trace = trace_sequential(instrument, path, pinhole_directions(psi[known]), apertures=False)
        through = refract(tube, trace.point, trace.direction)
        # In the meridional plane the normal of the wall is horizontal.
        back = trace.direction * (-1.0, -1.0, 1.0)
        onwards = trace_first_hits(instrument, back, through.at_inner, starts_in_lens=False)
        is_free = np.zeros(ELEVATIONS, dtype=bool)
        # The wall is met between the tube's ends, and nothing on the way across.
        is_free[known] = (onwards.status == Status.ESCAPED) & (onwards.sequence[:, 0] < 0) & through.meets(tube)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], is_free, [False]]).astype(int)))
        found[name] = tuple(
            (float(elevations[first]), float(elevations[after - 1]))
            for first, after in zip(edges[::2], edges[1::2], strict=True)
        )
    return found
