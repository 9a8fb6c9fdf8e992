"""What each pinhole angle of a view sees: the intended path, a cut aperture, or something in the way.

The image is scanned along one meridian; wherever the answer changes between neighbouring samples, the edge is found
by repeated subdivision. Angles in radians unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.design import Interval
from designer.trace.arrays import Array, Indices
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import Instrument
from designer.trace.sequential import trace_sequential

# Any azimuth would do, since the surfaces are round; a crooked one exercises all three coordinates.
SCAN_AZIMUTH = 0.3
EDGE_WIDTH_RAD = 1e-12
EDGE_POINTS = 63
MOST_EDGES_PER_CELL = 6

# Labels of a sample; from _FIRST_BLOCKED on they encode leg and element.
_CUT, _SEEN, _OUTSIDE, _FIRST_BLOCKED = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class AngleRun:
    """Neighbouring pinhole angles with one fate.

    ``is_seen`` is true inside the image circle only. A blocked run has the ``leg`` on which and the ``element``
    (row of ``instrument.elements``) by which it is blocked, else -1.
    """

    psi: Interval
    elevation_deg: Interval
    is_seen: bool
    leg: int
    element: int


@dataclass(frozen=True, slots=True)
class ImageZone:
    """Pinhole angles in degrees whose rays meet the same ``stations`` one after the other.

    The last station is "world", or the element that blocks the ray.
    """

    psi_deg: Interval
    stations: tuple[str, ...]
    is_blocked: bool


def find_runs(instrument: Instrument, path: Sequence[int], psi: Array, psi_circle: float) -> list[AngleRun]:
    """Runs of pinhole angles that the apertures of a path let through, edges to better than 1e-10 degrees.

    ``psi`` (n,) are rising sample angles; runs narrower than their spacing can go unnoticed.
    """

    def label(angles: Array) -> Indices:
        return _label(instrument, path, angles, psi_circle)

    starts, ends, fates = _split(label, psi, EDGE_WIDTH_RAD)
    kept = fates != _CUT
    elevations = np.degrees(_free_elevations(instrument, path, np.stack([starts[kept], ends[kept]]).ravel())).reshape(
        2, -1
    )
    count = len(instrument.elements)
    runs = []
    for start, end, fate, elevation in zip(starts[kept], ends[kept], fates[kept], elevations.T, strict=True):
        blocked = int(fate) - _FIRST_BLOCKED
        runs.append(
            AngleRun(
                psi=(float(start), float(end)),
                elevation_deg=(float(elevation.min()), float(elevation.max())),
                is_seen=bool(fate == _SEEN),
                leg=blocked // count if blocked >= 0 else -1,
                element=blocked % count if blocked >= 0 else -1,
            )
        )
    return runs


def map_image(instrument: Instrument, psi: Array) -> list[ImageZone]:
    """What the camera sees, from the image centre outwards, whatever the views intend; ``psi`` (n,) as above.

    Edges to 1e-7 rad; slivers beside an edge are found, others narrower than the samples can go unnoticed.
    """
    base = len(instrument.elements) + 2

    def label(angles: Array) -> Indices:
        trace = trace_first_hits(instrument, pinhole_directions(angles, SCAN_AZIMUTH))
        digits = np.concatenate([trace.sequence, trace.element[:, None]], axis=1) + 1
        return np.asarray(digits @ base ** np.arange(digits.shape[1]))

    starts, ends, _ = _split(label, psi, 1e-7)
    trace = trace_first_hits(instrument, pinhole_directions(starts, SCAN_AZIMUTH))
    zones = []
    for start, end, sequence, element in zip(starts, ends, trace.sequence, trace.element, strict=True):
        met = [instrument.elements[mirror] for mirror in sequence if mirror >= 0]
        last = "world" if element < 0 else instrument.elements[element]
        psi_deg = (float(np.degrees(start)), float(np.degrees(end)))
        zones.append(ImageZone(psi_deg, (*met, last), bool(element >= 0)))
    return zones


def _split(label: Callable[[Array], Indices], psi: Array, width: float) -> tuple[Array, Array, Indices]:
    """First angle, last angle and label of each run of equal labels; the edges between runs no wider than given."""
    labels = label(psi)
    changes = np.flatnonzero(labels[1:] != labels[:-1])
    low, high, after = _first_changes(label, psi[changes], psi[changes + 1], labels[changes], width)
    edges = [(low, high, after)]
    # A cell may hold several edges (a blocked sliver beside a cut): go on from the first one found.
    target, end = labels[changes + 1], psi[changes + 1]
    for _ in range(MOST_EDGES_PER_CELL):
        more = after != target
        if not more.any():
            break
        target, end = target[more], end[more]
        low, high, after = _first_changes(label, high[more], end, after[more], width)
        edges.append((low, high, after))
    low, high, after = (np.concatenate(part) for part in zip(*edges, strict=True))
    order = np.argsort(low, kind="stable")
    starts = np.concatenate([psi[:1], high[order]])
    ends = np.concatenate([low[order], psi[-1:]])
    return starts, ends, np.concatenate([labels[:1], after[order]])


def _first_changes(
    label: Callable[[Array], Indices], low: Array, high: Array, before: Indices, width: float
) -> tuple[Array, Array, Indices]:
    """Narrow cells (low, high) of one label at low and another at high down to the first change that shows.

    Returns the last angle with the label before, the first one with another, and that label.
    """
    fractions = np.linspace(0.0, 1.0, EDGE_POINTS + 2)
    rows = np.arange(low.size)
    after = before
    while low.size:
        inner = low[:, None] + (high - low)[:, None] * fractions
        inner[:, -1] = high
        fates = label(inner[:, 1:].ravel()).reshape(low.size, -1)
        first = np.argmax(fates != before[:, None], axis=1)
        after = fates[rows, first]
        is_narrow = np.max(high - low) <= width
        low, high = inner[rows, first], inner[rows, first + 1]
        if is_narrow:
            break
    return low, high, after


def _label(instrument: Instrument, path: Sequence[int], psi: Array, psi_circle: float) -> Indices:
    directions = pinhole_directions(psi, SCAN_AZIMUTH)
    let_through = trace_sequential(instrument, path, directions).missed < 0
    labels = np.full(psi.size, _CUT, dtype=np.intp)
    report = compare_with_path(trace_first_hits(instrument, directions[let_through]), path)
    blocked = _FIRST_BLOCKED + report.leg * len(instrument.elements) + report.element
    seen = np.where(psi[let_through] <= psi_circle, _SEEN, _OUTSIDE)
    labels[let_through] = np.select(
        [report.status == Status.OK, report.status == Status.BLOCKED], [seen, blocked], _CUT
    )
    return labels


def _free_elevations(instrument: Instrument, path: Sequence[int], psi: Array) -> Array:
    trace = trace_sequential(instrument, path, pinhole_directions(psi, SCAN_AZIMUTH), apertures=False)
    return elevation_angles(trace.direction)


def single_viewpoint_residuals(
    instrument: Instrument,
    path: Sequence[int],
    viewpoint: float,
    gain: float,
    sense: str,
    psi: Array,
    azimuth: Array | float,
) -> tuple[float, float]:
    """Largest distance in mm of an exit line from the viewpoint, and largest deviation from the gain law.

    The law is tan(psi/2) = gain tan(pi/4 +- phi/2), + for sense "direct"; phi is measured from the traced exit
    direction, and the tangent counts negative when the ray leaves on the other side of the axis. Over the rays that
    the apertures let through; infinite if there is none.
    """
    directions = pinhole_directions(psi, azimuth)
    trace = trace_sequential(instrument, path, directions)
    through = trace.missed < 0
    if not through.any():
        return np.inf, np.inf
    leaving, start = trace.direction[through], trace.point[through]
    to_viewpoint = np.array([0.0, 0.0, viewpoint]) - start
    miss = np.linalg.norm(np.cross(to_viewpoint, leaving), axis=1)
    sent = directions[through]
    side = np.where(leaving[:, 0] * sent[:, 0] + leaving[:, 1] * sent[:, 1] < 0.0, -1.0, 1.0)
    sign = 1.0 if sense == "direct" else -1.0
    half_tangent = side * np.tan(np.pi / 4.0 + sign * elevation_angles(leaving) / 2.0)
    half_psi = np.hypot(sent[:, 0], sent[:, 1]) / (1.0 + sent[:, 2])
    return _largest(miss), _largest(np.abs(half_psi - gain * half_tangent))


def _largest(values: Array) -> float:
    largest = float(np.max(values))
    return np.inf if np.isnan(largest) else largest
