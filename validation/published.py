"""What papers publish."""

from __future__ import annotations

import math
from functools import cache

from scipy.optimize import brentq

from designer.design import Design, Sense
from designer.evaluate.fabrication import surface_of
from designer.optics.conic import FocalConic
from designer.optics.conversions import (
    BakerNayarForm,
    FocalForm,
    SemiAxesForm,
    Sheet,
    focal_from_baker_nayar,
    focal_from_semi_axes,
    vertex_from_focal,
)
from designer.optics.focus import FocusingMirror, LightPath, chief_ray, reciprocal_image_depth
from designer.optics.view import image_radius
from designer.optimise.search import search
from designer.requirement import set_key
from designer.verify.judge import judge
from validation.problem import CONFIGURATION, REQUIREMENT
from validation.row import Row

CONVEX = Sheet("convex")
SLOPE = 0.25
# c1, c2, k1, k2, d and the outer radius, as published, in mm.
UPPER, LOWER, FAR_FOCI, OUTER_RADIUS = (123.488, 5.7319), (241.803, 9.7443), 233.684, 37.0
ROUNDED = "the source gives no more"


@cache
def jaramillos_rig(fold_radius: float = 20.0, hole: float = 0.0) -> Design:
    """The rig from its published parameters: two hyperboloids of Baker and Nayar and a fold plane half way."""
    mirrors = [_plane(fold_radius)]
    for name, (between_foci, k), far, faces, inner in (
        ("primary", LOWER, FAR_FOCI, "up", hole),
        ("direct", UPPER, 0.0, "down", 0.0),
    ):
        focal = focal_from_baker_nayar(BakerNayarForm(between_foci / 2.0, k, "hyperboloid", CONVEX))
        form, side = vertex_from_focal(focal), 1.0 if faces == "down" else -1.0
        mirrors.append(
            {
                "name": name,
                "kind": "hyperboloid",
                "vertex_mm": far + side * focal.vertex_distance,
                "radius_mm": side * form.radius,
                "conic": form.conic_constant,
                "inner_radius_mm": inner,
                "outer_radius_mm": OUTER_RADIUS,
                "thickness_mm": 2.0,
                "faces": faces,
            }
        )
    asked = [-10.0, 10.0]
    views = {
        "upper": _view(["direct"], UPPER[0], focal_gain(UPPER), "direct", "outer"),
        "lower": _view(["secondary", "primary"], FAR_FOCI - LOWER[0], focal_gain(LOWER), "folded", "inner"),
    }
    return Design.model_validate(
        {
            "schema": 1,
            "configuration": "folded-HyPl-Hy-upper_outer",
            "camera": {
                "focal_length_mm": 8.0,
                "pixel_pitch_mm": 0.0044,
                "width_px": 1600,
                "height_px": 1200,
                "f_number": 8.0,
                "lens_radius_mm": 3.0,
                "lens_front_mm": 1.0,
                "lens_length_mm": 30.0,
                "body_radius_mm": 15.0,
            },
            "mirrors": mirrors,
            "views": views,
            "baseline_mm": UPPER[0] - FAR_FOCI + LOWER[0],
            "height_mm": 150.0,
            "diameter_mm": 2.0 * OUTER_RADIUS,
            "working_volume": {"elevation_deg": asked, "distance_mm": [1000.0, 5000.0]},
            "noise_px": 0.1,
        }
    )


def focal_gain(mirror: tuple[float, float]) -> float:
    """The gain of a hyperboloid of Baker and Nayar's c and k."""
    return focal_from_baker_nayar(BakerNayarForm(mirror[0] / 2.0, mirror[1], "hyperboloid", CONVEX)).gain


def _plane(radius: float) -> dict[str, object]:
    return {
        "name": "secondary",
        "kind": "plane",
        "vertex_mm": FAR_FOCI / 2.0,
        "radius_mm": None,
        "conic": 0.0,
        "inner_radius_mm": 0.0,
        "outer_radius_mm": radius,
        "thickness_mm": 2.0,
        "faces": "down",
    }


def _view(path: list[str], viewpoint: float, gain: float, sense: Sense, zone: str) -> dict[str, object]:
    return {
        "path": path,
        "viewpoint_mm": viewpoint,
        "gain": gain,
        "sense": sense,
        "elevation_deg": [-10.0, 10.0],
        "zone": zone,
    }


def fold_radius() -> float:
    """Where the traced mirror of the upper view meets the height of the fold plane."""
    direct = surface_of(jaramillos_rig().mirror("direct"))
    return float(brentq(lambda radius: direct.height(radius) - FAR_FOCI / 2.0, 1.0, 37.0, xtol=1e-13))


def hole_radius() -> float:
    """Where the straight line from the lower viewpoint to the upper mirror's rim leaves the primary."""
    rig = jaramillos_rig()
    primary, viewpoint = surface_of(rig.mirror("primary")), rig.views.lower.viewpoint_mm
    rim = surface_of(rig.mirror("direct")).height(OUTER_RADIUS)
    steepness = (rim - viewpoint) / OUTER_RADIUS
    return float(brentq(lambda radius: viewpoint + steepness * radius - primary.height(radius), 0.1, 37.0, xtol=1e-13))


def traced_baseline() -> float:
    """The distance between the points at which the rays of the two views meet."""
    return judge(jaramillos_rig(fold_radius(), hole_radius()), whole_image=False).baseline_mm


def best_focus_mm() -> float:
    """Where the lens of Baker and Nayar's example is focused best, closed form."""
    between_foci, gain = 1000.0, focal_from_baker_nayar(BakerNayarForm(500.0, 4.0, "hyperboloid", CONVEX)).gain
    mirror = FocusingMirror(FocalConic(0.0, between_foci / (1.0 + gain), 1.0 / gain))
    ray = chief_ray(LightPath((mirror,), between_foci, gain, "direct"), -1.0)
    return float(1.0 / reciprocal_image_depth(ray, 1.0 / 5000.0))


def imaged_by(a: float, kind: str) -> float:
    """Image radius behind a mirror of semi-axis a and c = 60 mm, f = 12 mm, at the slope 0.25."""
    b = math.sqrt(abs(60.0**2 - a**2))
    sheet = CONVEX if kind == "hyperboloid" else Sheet("concave")
    focal: FocalForm = focal_from_semi_axes(SemiAxesForm(a, b, 60.0, sheet))
    return float(image_radius(SLOPE, focal.gain, 12.0, "direct"))


def imaged_by_paraboloids() -> float:
    """Image radius behind paraboloids of focal lengths 6 and 110 mm, f = 12 mm, at the slope 0.25."""
    return float(image_radius(SLOPE, 6.0 / 110.0, 12.0, "folded"))


def least_height() -> float:
    """The smallest height that holds the prototype's baseline, field and diameter."""
    asked = set_key(set_key(REQUIREMENT, "objective.then", "diameter"), "objective.minimise", "height")
    first = search(asked, CONFIGURATION).first
    assert first is not None
    return first.goals["height"]


ROWS = (
    Row("jaramillo_fold_radius_mm", "radius of the fold plane of Jaramillo's rig", "mm", fold_radius, ".6f",
        few_digits=ROUNDED),
    Row("jaramillo_hole_radius_mm", "radius of the hole in its primary", "mm", hole_radius, ".6f", few_digits=ROUNDED),
    Row("jaramillo_baseline_mm", "its baseline, from traced rays", "mm", traced_baseline, ".6f"),
    Row("baker_nayar_focus_mm", "best focus in Baker and Nayar's example of defocus, from ... to", "mm",
        best_focus_mm, ".4f", few_digits="published as a range, of which ours must be part", is_bound=True),
    Row("paper_hyperboloid_mm", "image radius by equations (2) to (5), hyperboloid a = 48, c = 60 mm", "mm",
        lambda: imaged_by(48.0, "hyperboloid"), ".12f"),
    Row("paper_ellipsoid_mm", "image radius by equations (2) to (5), ellipsoid a = 80, c = 60 mm", "mm",
        lambda: imaged_by(80.0, "ellipsoid"), ".12f"),
    Row("paper_paraboloids_mm", "image radius by equations (6) to (9), p1 = 6, p2 = 110 mm", "mm",
        imaged_by_paraboloids, ".12f"),
    Row("paper_height_mm", "height of the paper's prototype, at least the smallest that we find", "mm",
        least_height, ".4f", convergence="sequential quadratic programming to 1e-6, from many starts",
        few_digits="the built system, to the millimetre; a bound", is_quick=False, is_bound=True),
)  # fmt: skip
