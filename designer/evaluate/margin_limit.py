"""The least depth error of mirrors that have edges: the limit with margins (docs/theory.md, section 6).

The limit of :mod:`designer.evaluate.limit` lets the two zones of the image touch. Mirrors cannot: a face reaches an
edge margin and half the width of the light beyond what it uses, and light passes another mirror's edge at a clearance.
Seen from the pinhole that takes a slope K / h out of the image, where K is what margins and light take up and h the
height of the edge between the zones. What bounds h is the envelope: the height of the head, the width of a mirror, and
the baseline, which in a direct design puts the lower mirror far below the top. Either the edge of the inner zone's
mirror or the hole in the outer zone's stands between the zones, and the limit takes the one that costs less.

Everything left out can only make designs worse: light of secondaries and beyond edges is taken to have no width where
it is not known, and whether the primary, the world's rays and the lens find room is not asked.
Lengths in mm, angles in radians; floats only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import PerView, ViewName
from designer.evaluate.depth import NoiseModel, StereoPair, Volume, depth_error_rms
from designer.evaluate.limit import Arrangement, ImageBounds
from designer.optics.image_law import most_favourable
from designer.optics.view import elevation_tangents_of_views, half_angle_tangent

Array = NDArray[np.float64]

FREE_GAINS = PerView(lower=np.inf, upper=np.inf)

# Gains tried, of the outer view and for each of them of the inner one, in even steps up to the largest.
_OUTER_NODES, _INNER_NODES = 33, 513


@dataclass(frozen=True, slots=True)
class FirstMirrors:
    """The mirrors that light meets first, all facing down: a direct mirror for a view, or the secondary.

    ``upper`` and ``lower`` are the signs of the direct mirrors' gains: +1 convex, whose face rises outwards, -1
    concave. ``lower`` is None where the lower view goes over a secondary; ``secondary_rises`` tells whether that may be
    convex, ``secondary_falls`` whether it may be concave.
    """

    upper: int
    lower: int | None
    secondary_rises: bool = False
    secondary_falls: bool = False


@dataclass(frozen=True, slots=True)
class MirrorBounds:
    """What mirrors and light have to keep, in mm.

    ``highest`` is the greatest height of a face that looks down, ``widest`` the greatest radius of a mirror,
    ``steepest`` the greatest slope of a face as a tangent, ``barrel`` the greatest slope from the axis of a ray through
    the lens. ``reciprocal_focus`` is 1 / u of the plane in focus, 1/mm, ``upper_viewpoint`` the greatest height of the
    upper viewpoint, and ``gains`` are the greatest gains of the views; infinite if they are free.
    """

    edge_margin: float
    clearance: float
    thickness: float
    highest: float
    widest: float
    steepest: float
    barrel: float
    pupil_radius: float = 0.0
    reciprocal_focus: float = np.inf
    upper_viewpoint: float = np.inf
    gains: PerView[float] = FREE_GAINS


@dataclass(frozen=True, slots=True)
class _Zone:
    """A view on its first mirror: gains (signed, arrays), ends of its half-angle tangents, pinhole tangents there.

    ``gain`` is None for a secondary, whose shape is not known. ``slope`` is the greatest slope of the face between its
    used zone and the other zone, positive if it rises outwards. ``width`` is the least half-width of the light in units
    of the pupil's radius, across the axis, and ``radial`` that of its footprint along R. ``nearness`` holds the least
    and the greatest ratio of the face's height to the depth of the farthest points' virtual image.
    """

    gain: Array | None
    inner: Array
    outer: Array
    slope: Array
    width: Array
    radial: Array
    nearness: tuple[Array, Array]

    @property
    def rises(self) -> bool:
        """Whether the face is known to rise outwards, as a convex direct mirror does."""
        return self.gain is not None and bool(np.all(self.gain > 0.0))


def margin_gains(
    arrangement: Arrangement,
    mirrors: FirstMirrors,
    volume: Volume,
    baseline: float,
    principal_distance: float,
    image: ImageBounds,
    bounds: MirrorBounds,
) -> PerView[float]:
    """Bound of each view's gain, as an absolute value; zero where nothing has room."""
    low, high = volume.elevations
    slopes = elevation_tangents_of_views((np.tan(low), np.tan(high)), volume.distances, baseline)
    tangents: dict[ViewName, Array] = {
        "upper": np.sort([float(half_angle_tangent(end, arrangement.sense_upper)) for end in slopes.upper]),
        "lower": np.sort([float(half_angle_tangent(end, arrangement.sense_lower)) for end in slopes.lower]),
    }
    outer, inner = arrangement.outer_view, arrangement.inner_view
    widest = float(image.law.half_tangent(image.image_radius_mm / principal_distance))
    widest = min(widest, bounds.barrel / (1.0 + np.hypot(1.0, bounds.barrel)) if np.isfinite(bounds.barrel) else 1.0)
    most = {view: _most_gain(mirrors, view, tangents[view][1], bounds) for view in tangents}
    largest = min(widest / tangents[outer][1], most[outer])
    if largest <= 0.0:
        return PerView(lower=0.0, upper=0.0)
    outer_gain = largest * np.linspace(0.0, 1.0, _OUTER_NODES)[1:, None]
    begins = outer_gain * tangents[outer][0]
    left = principal_distance * image.law.ratio(begins) - image.zone_gap_mm
    inner_ends = np.where(left > 0.0, image.law.half_tangent(np.maximum(left, 0.0) / principal_distance), 0.0)
    shares = np.linspace(0.0, 1.0, _INNER_NODES)[1:]
    inner_gain = np.maximum(inner_ends, 1e-12) / tangents[inner][1] * shares
    gains = dict(zip((outer, inner), np.broadcast_arrays(outer_gain, inner_gain), strict=True))
    with np.errstate(all="ignore"):
        far = volume.distances[1]
        zones = {
            view: _zone(mirrors, view, tangents[view], gains[view], begins if view == inner else None, far, bounds)
            for view in gains
        }
        has_room = _has_room(mirrors, zones, outer, baseline, tangents["upper"], bounds)
        has_room &= (inner_ends > 0.0) & (inner_gain <= most[inner] * (1.0 + 1e-9))
        if image.law.is_perspective:
            # The image's own gap, and half of each zone's blur.
            mixed = _mixing(zones, outer, baseline, tangents["upper"], bounds)
            gap = _slope(begins) - _slope(zones[inner].outer)
            has_room &= gap - image.zone_gap_mm / principal_distance >= mixed
    if not has_room.any():
        return PerView(lower=0.0, upper=0.0)
    # The first node without room is a bound: between it and the last with room the room ends.
    last = np.where(has_room.any(axis=1), _INNER_NODES - 2 - np.argmax(has_room[:, ::-1], axis=1), -1)
    following = np.minimum(last + 1, _INNER_NODES - 2)
    rows = np.flatnonzero(last >= 0)
    best = float(inner_gain[rows, following[rows]].max())
    return PerView(lower=best, upper=largest) if outer == "upper" else PerView(lower=largest, upper=best)


def margin_limit(
    arrangement: Arrangement,
    mirrors: FirstMirrors,
    volume: Volume,
    baseline: float,
    principal_distance: float,
    image: ImageBounds,
    bounds: MirrorBounds,
    noise_mm: float | NoiseModel,
    scale_uncertainty: float = 0.0,
) -> float | None:
    """The score (RMS of sigma_D / D) at the bounds of :func:`margin_gains`; None where nothing has room.

    With a constant noise no mirrors within the bounds can beat it. Of two direct views it counts the noise alone,
    whatever the relative uncertainty of the image's scale.
    """
    gains = margin_gains(arrangement, mirrors, volume, baseline, principal_distance, image, bounds)
    if min(gains.lower, gains.upper) <= 0.0:
        return None
    senses = arrangement.sense_lower, arrangement.sense_upper
    law = most_favourable(image.law)
    pair = StereoPair(gains.lower, senses[0], gains.upper, senses[1], baseline, principal_distance, law)
    return float(depth_error_rms(pair, volume, noise_mm, scale_uncertainty if senses[0] != senses[1] else 0.0))


def _has_room(
    mirrors: FirstMirrors,
    zones: dict[str, _Zone],
    outer: str,
    baseline: float,
    tangents: Array,
    bounds: MirrorBounds,
) -> NDArray[np.bool_]:
    """Whether an edge and its light fit between the zones, for gains (n, m); ``tangents`` are the upper view's."""
    inner = "lower" if outer == "upper" else "upper"
    of_outer, of_inner = zones[outer], zones[inner]
    highest = _highest_viewpoint(zones["upper"], tangents, bounds)
    viewpoints = {"upper": highest, "lower": np.maximum(highest - baseline, 1e-9)}
    begins, ends = of_outer.inner, of_inner.outer
    edge, clearance, pupil = bounds.edge_margin, bounds.clearance, bounds.pupil_radius
    own, above = _heights_of_inner(of_inner, viewpoints[inner], begins, bounds)
    face, beside = _heights_of_outer(mirrors, of_outer, viewpoints[outer], bounds)
    past_edge, through_hole = _light_past_edge(of_outer, None, bounds), np.zeros_like(begins)
    if of_inner.gain is not None and of_outer.gain is not None:
        # Light on its way to a mirror much higher up is nearly as wide as the pupil where it passes the edge.
        dip = bounds.steepest * pupil
        past_edge = _light_past_edge(of_outer, above / (face - dip * np.maximum(of_outer.radial, 1.0)), bounds)
        share = beside / (own - dip * np.maximum(of_inner.radial, 1.0))
        through_hole = np.where((share > 0.0) & (share < 1.0), pupil * (1.0 - share), 0.0)

    across, gap = _slope(begins), _slope(begins) - _slope(ends)
    turned = np.maximum(1.0 - np.maximum(of_inner.slope, 0.0) * across, 0.0)
    rim = edge + pupil * of_inner.radial
    edge_fits = gap * np.minimum(own, beside) >= clearance + rim * turned + past_edge
    if of_inner.gain is not None:
        radius, height = _beside(of_inner.gain, viewpoints[inner], ends, rim)
        edge_fits &= (turned == 0.0) | (height * across >= radius + clearance + past_edge)
    turned = np.maximum(1.0 - np.maximum(of_outer.slope, 0.0) * across, 0.0)
    rim = edge + pupil * of_outer.radial
    hole_fits = gap * np.minimum(above, beside) >= clearance + rim * turned + through_hole
    if of_outer.gain is not None:
        radius, height = _beside(of_outer.gain, viewpoints[outer], begins, -rim)
        hole_fits &= (turned == 0.0) | (radius >= height * _slope(ends) + clearance + through_hole)
    if of_inner.gain is not None and of_outer.gain is not None:
        # The baseline holds the two mirrors apart: an edge that cannot come to the other's face is not between zones.
        lowest_edge = np.minimum(own, _face_height(of_inner, viewpoints[inner], begins, bounds))
        lowest_hole = np.minimum(face, viewpoints[outer] / (1.0 + of_outer.gain))
        edge_fits &= lowest_edge <= beside
        hole_fits &= lowest_hole <= above
    return np.asarray(edge_fits | hole_fits)


def _mixing(zones: dict[str, _Zone], outer: str, baseline: float, tangents: Array, bounds: MirrorBounds) -> Array:
    """Half the least sum of both zones' blurs, over the principal distance, as far as direct mirrors tell."""
    inner = "lower" if outer == "upper" else "upper"
    highest = _highest_viewpoint(zones["upper"], tangents, bounds)
    viewpoints = {"upper": highest, "lower": np.maximum(highest - baseline, 1e-9)}
    ends = {inner: zones[inner].outer, outer: zones[outer].inner}
    least, most = {}, {}
    for view, zone in zones.items():
        if zone.gain is not None:
            height = _face_height(zone, viewpoints[view], ends[view], bounds)
            least[view], most[view] = zone.nearness[0] / height, zone.nearness[1] / height
    # Lower mirrors have nearer images still: none is nearer to the plane in focus than at the greatest heights.
    mixed = np.zeros_like(highest)
    for nearness in least.values():
        mixed = mixed + np.maximum(nearness - bounds.reciprocal_focus, 0.0)
    if "lower" in least:
        mixed = np.maximum(mixed, least["lower"] - most["upper"])
    return np.asarray(bounds.pupil_radius * mixed)


def _beside(gain: Array, viewpoint: Array, at: Array, shift: Array) -> tuple[Array, Array]:
    """Radius and height of a direct mirror's face, so far beside its point of pinhole tangent ``at``; NaN off it."""
    vertex = viewpoint / (1.0 + gain)
    radius = 2.0 * vertex * at / (1.0 - at * at / gain) + shift
    there = radius / (vertex + np.sqrt(vertex * vertex + radius * radius / gain))
    return radius, vertex * (1.0 - there * there) / (1.0 - there * there / gain)


def _light_past_edge(zone: _Zone, share: Array | None, bounds: MirrorBounds) -> Array:
    """Least half-width of the outer zone's light, along R, where it passes the edge of the inner zone's mirror.

    ``share`` is how far up to its own mirror that edge can be at most; None where it may be anywhere.
    """
    pupil, width = bounds.pupil_radius, np.minimum(zone.width, 1.0)
    beside = np.zeros_like(width)
    if zone.rises:
        # At the height of the face itself it is the face's edge that needs room, or its back.
        steepness = np.maximum(zone.slope, 1e-9)
        beside = np.minimum(pupil * width, np.minimum(bounds.edge_margin, bounds.thickness / steepness))
    if share is None:
        return beside
    below = pupil * (1.0 - share * (1.0 - (width if zone.rises else 0.0)))
    return np.where((share > 0.0) & (share < 1.0), below, beside)


def _heights_of_inner(zone: _Zone, viewpoint: Array, begins: Array, bounds: MirrorBounds) -> tuple[Array, Array]:
    """Greatest heights of the inner zone's face: where its zone ends, and anywhere up to where the other begins."""
    own = _face_height(zone, viewpoint, zone.outer, bounds)
    return own, np.maximum(own, _face_height(zone, viewpoint, begins, bounds))


def _heights_of_outer(
    mirrors: FirstMirrors, zone: _Zone, viewpoint: Array, bounds: MirrorBounds
) -> tuple[Array, Array]:
    """Greatest heights of the outer zone's face: where its zone begins, and anywhere nearer to the axis."""
    face = _face_height(zone, viewpoint, zone.inner, bounds)
    if zone.gain is not None:
        # A face that falls outwards is highest at its vertex.
        return face, face if zone.rises else np.maximum(viewpoint / (1.0 + zone.gain), face)
    if mirrors.secondary_falls:
        return face, face
    face = np.minimum(face, (bounds.widest - bounds.edge_margin) / _slope(zone.outer))
    return face, face


def _most_gain(mirrors: FirstMirrors, view: ViewName, tangent: float, bounds: MirrorBounds) -> float:
    """The greatest gain that is allowed and that no concave direct mirror is too steep for, at its outer end."""
    sign, allowed = mirrors.upper if view == "upper" else mirrors.lower, bounds.gains[view]
    if sign is None or sign > 0:
        return allowed
    steepest = bounds.steepest
    return min(allowed, max(steepest - tangent, 0.0) / (tangent * (1.0 + steepest * tangent)))


def _zone(
    mirrors: FirstMirrors,
    view: ViewName,
    tangents: Array,
    gain: Array,
    other_begins: Array | None,
    farthest: float,
    bounds: MirrorBounds,
) -> _Zone:
    """A view's zone; ``other_begins`` is the pinhole tangent up to which an inner zone's face may reach."""
    sign = mirrors.upper if view == "upper" else mirrors.lower
    inner, outer = gain * tangents[0], gain * tangents[1]
    at = inner if other_begins is None else other_begins
    if sign is None:
        # Its light goes down to the primary at the zone's outer end: mu t < 1 there.
        most = (1.0 / outer - 1.0) * at / (1.0 + at * at / outer)
        rise = np.minimum(most, bounds.steepest) if mirrors.secondary_rises else np.zeros_like(gain)
        nothing = np.zeros_like(gain)
        return _Zone(None, inner, outer, rise, nothing, nothing, (nothing, nothing + np.inf))
    signed = sign * gain
    # On the vertex sheet t^2 < |kappa|, and the slope grows up to there.
    at = np.minimum(at, np.sqrt(gain))
    slope = at * (1.0 - signed) / (signed + at * at)
    used, end = (inner, tangents[0]) if other_begins is None else (outer, tangents[1])
    width, nearness = _light_on_direct_mirror(signed, used, end, farthest, bounds)
    radial = width / (1.0 - _slope(used) * used * (1.0 - signed) / (signed + used * used))
    return _Zone(signed, inner, outer, slope, width, radial, nearness)


def _light_on_direct_mirror(
    gain: Array, used: Array, end: float, farthest: float, bounds: MirrorBounds
) -> tuple[Array, tuple[Array, Array]]:
    """The least half-width of a far point's light, in pupil radii, and the nearness of its virtual image.

    By the half-angle tangents at the pinhole and at the viewpoint. With q the mirror's power, less the scene's
    nearness, times its distance from the pinhole, the width is 1 / |1 - q| and the nearness 1 - 1 / (1 - q).
    """
    power = (1.0 - 1.0 / gain) * (1.0 - gain * end * end) / (1.0 + end * end)
    # Distance of the face over that of the scene from it, at most; cos(phi) <= 1, cos(psi) from t.
    room = farthest - bounds.widest
    scene = bounds.highest * (1.0 + used * used) / (1.0 - used * used) / room if room > 0.0 else np.inf
    if np.all(gain > 0.0):
        power = np.maximum(-power, 0.0)
        width = np.asarray(1.0 / (1.0 + power + scene))
        return width, (power / (1.0 + power), 1.0 - width)
    excess = np.maximum(power - 1.0, 1e-9)
    nearest = power - scene - 1.0
    width = np.where(nearest > 0.0, 1.0 / excess, 0.0)
    return width, (1.0 + 1.0 / excess, np.where(nearest > 0.0, 1.0 + 1.0 / nearest, np.inf))


def _highest_viewpoint(zone: _Zone, tangents: Array, bounds: MirrorBounds) -> Array:
    """The greatest height of the upper viewpoint, whose mirror has to lie below the top and within the width."""
    assert zone.gain is not None
    heights = [_relative_height(zone.gain, at) for at in (zone.inner, zone.outer)]
    rim = np.maximum(zone.outer * (1.0 - zone.gain) / (zone.gain + zone.outer**2), 0.0) * bounds.edge_margin
    least = np.minimum(bounds.highest / heights[0], (bounds.highest - rim) / heights[1])
    least = np.minimum(least, (bounds.widest - bounds.edge_margin) / _slope(zone.outer) / heights[1])
    return np.asarray(np.minimum(least, bounds.upper_viewpoint))


def _face_height(zone: _Zone, viewpoint: Array, at: Array, bounds: MirrorBounds) -> Array:
    """The greatest height of a face where the half-angle tangent at the pinhole is ``at``."""
    if zone.gain is None:
        return np.full_like(at, bounds.highest)
    height = _relative_height(zone.gain, at)
    # Beyond the end of its sheet a face has no height of its own; the envelope's bounds it.
    return np.where(height > 0.0, np.minimum(viewpoint * height, bounds.highest), bounds.highest)


def _relative_height(gain: Array, at: Array) -> Array:
    """Height of a direct mirror over that of its viewpoint, where the half-angle tangent at the pinhole is ``at``."""
    return np.asarray((1.0 - at * at) / ((1.0 + gain) * (1.0 - at * at / gain)))


def _slope(half_tangent: Array) -> Array:
    return np.asarray(2.0 * half_tangent / (1.0 - half_tangent * half_tangent))
