"""Fabrication notes: what no rule of a requirement forbids, but whoever orders the mirrors must know."""

from __future__ import annotations

import math

from designer.configurations import FLATTEST, MOST_PARABOLIC, MirrorKind, enumerate_configurations
from designer.design import Design, Mirror
from designer.evaluate.fabrication import mirror_shape

NARROWEST_HOLE_MM = 2.0
"""Diameter below which a hole is hard to drill through a substrate and to turn up to."""
TIGHTEST_CURVATURE_MM = 1.0
"""Radius of curvature of a face below which a diamond tool's nose is as wide, and few instruments measure."""
# So near to a bound between kinds, as a share of the inverse eccentricity, a mirror counts as held there.
AT_THE_BOUND = 1e-3


def fabrication_notes_on(design: Design) -> list[str]:
    """Say what to look at before ordering a design's mirrors; plain sentences, most urgent first.

    A mirror that is hard to make; an entrance pupil wider than clearance or edge margin, for a record of chief rays
    alone, which these hold every leg of light to (left out where it does not say what was asked); a mirror of a folding
    pair held at the bound that tells its kind from the next.
    """
    made = [note for mirror in design.mirrors for note in _on_making(mirror)]
    kinds = [note for name in _folding_pair(design) for note in _on_kind(design, name)]
    return [*made, *_on_pupil(design), *kinds]


def tightest_curvature_mm(mirror: Mirror) -> float:
    """Smallest radius of curvature of a face, over both principal directions; infinite for a plane."""
    if mirror.radius_mm is None:
        return math.inf
    radius = abs(mirror.radius_mm)
    # Across the axis the radius of curvature is r w, along it r w^3, with w^2 = 1 - K R^2 / r^2, which is monotonic.
    widenings = [
        math.sqrt(1.0 - mirror.conic * (edge / radius) ** 2)
        for edge in (mirror.inner_radius_mm, mirror.outer_radius_mm)
    ]
    return min(radius * widening**power for widening in widenings for power in (1, 3))


def _on_making(mirror: Mirror) -> list[str]:
    hole, curvature = 2.0 * mirror.inner_radius_mm, tightest_curvature_mm(mirror)
    found = []
    if 0.0 < hole < NARROWEST_HOLE_MM:
        found.append(f"a hole {hole:.2f} mm in diameter (below {NARROWEST_HOLE_MM:g} mm)")
    if curvature < TIGHTEST_CURVATURE_MM:
        found.append(f"a radius of curvature of {curvature:.2f} mm (below {TIGHTEST_CURVATURE_MM:g} mm)")
    if not found:
        return []
    return [
        f"the {mirror.name} mirror has {' and '.join(found)}, which is hard to turn and to measure; to enlarge the "
        f"mirror, increase manufacture.smallest_mirror_radius_mm (its outer radius is {mirror.outer_radius_mm:.2f} mm)"
    ]


def _on_pupil(design: Design) -> list[str]:
    if design.sharpness is not None:
        return []
    camera, pupil_mm = design.camera, design.camera.pupil_radius_mm
    asked = {"clearance_mm": design.clearance_mm, "edge_margin_mm": design.edge_margin_mm}
    short = {f"manufacture.{key}": value for key, value in asked.items() if value is not None and value < pupil_mm}
    if not short:
        return []
    told = " and ".join(f"{key} = {value:g}" for key, value in short.items())
    least = min(short.values())
    stop = camera.f_number * pupil_mm / least if least else math.inf
    # Rounded up to a tenth: the pupil must not be wider than what was asked.
    stopped = f", or stopping the lens down to f/{math.ceil(10.0 * stop - 1e-6) / 10.0:g}" if stop < 100.0 else ""
    return [
        f"the entrance pupil is {2.0 * pupil_mm:.2f} mm in diameter (f/{camera.f_number:g}), but clearances and "
        f"margins apply to the chief ray: with {told}, edges cause vignetting at the ends of the zones; "
        f"{_rounded_up(pupil_mm)} mm for "
        f"{'each' if len(short) > 1 else 'it'}{stopped}, avoids nearly all of it"
    ]


def _rounded_up(length_mm: float) -> str:
    return f"{math.ceil(100.0 * length_mm - 1e-6) / 100.0:.2f}"


def _folding_pair(design: Design) -> tuple[str, ...]:
    """The secondary and the primary of a folded design; nothing for a direct one."""
    path = design.views.lower.path
    return path if len(path) == 2 else ()


def _on_kind(design: Design, name: str) -> list[str]:
    mirror, focal = design.mirror(name), mirror_shape(design, name).focal
    if focal is None or mirror.kind not in {"hyperboloid", "ellipsoid"}:
        return []
    # Ellipsoids are measured by the eccentricity, which runs from a sphere (0) to a paraboloid (1).
    size = abs(focal.inverse_eccentricity)
    measure = size if mirror.kind == "hyperboloid" else 1.0 / size
    if measure >= MOST_PARABOLIC * (1.0 - AT_THE_BOUND):
        # From the pinhole a paraboloid is the limit of concave mirrors alone, whose second focus lies behind them.
        is_limit = focal.inverse_eccentricity < 0.0 or name != design.views.lower.path[0]
        next_kind, codes = "a paraboloid", ("PaPa" if is_limit else "")
    elif measure <= FLATTEST * (1.0 + AT_THE_BOUND):
        next_kind = "a plane" if mirror.kind == "hyperboloid" else "a sphere"
        codes = _with_plane(design, name) if mirror.kind == "hyperboloid" else ""
    else:
        return []
    sibling = _sibling(design, codes)
    towards = f", towards {sibling}" if sibling else ""
    article = "an" if mirror.kind == "ellipsoid" else "a"
    return [
        f"the {name} mirror is at the limit of its conic constant, {mirror.conic:.4g}, which separates {article} "
        f"{mirror.kind} from {next_kind}: the optimum lies beyond this limit{towards}"
    ]


def _with_plane(design: Design, name: str) -> str:
    """The codes of the folding pair with one of its mirrors flattened."""
    codes = design.configuration.split("-")[1] if design.configuration.count("-") == 3 else ""
    plane = MirrorKind.PLANE.value
    return plane + codes[2:] if name == "primary" else codes[:2] + plane


def _sibling(design: Design, codes: str) -> str:
    """The configuration with another folding pair; empty if it is none of the 44."""
    parts = design.configuration.split("-")
    name = "-".join([parts[0], codes, *parts[2:]])
    return name if name in {configuration.name for configuration in enumerate_configurations()} else ""
