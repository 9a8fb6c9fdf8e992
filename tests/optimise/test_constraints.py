"""What the rules measure, against traced rays and the surfaces of the design record, for random designs."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from designer.design import Design
from designer.optimise.constraints import SHEET_MARGIN, SHORTEST_VERTEX_DISTANCE_MM, Constraint, constraints_of
from designer.optimise.problem import Problem, evaluate
from designer.optimise.system import put_together
from designer.optimise.variables import with_principal_distance
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument, sag
from designer.trace.pencils import DISC_RMS_PER_DIAMETER, trace_bundles
from designer.trace.sequential import trace_sequential
from designer.verify.judge import judge
from support.shipped_problems import (
    CHIEF_RAYS_ALONE,
    CONFIGURATIONS,
    VARIANTS,
    Array,
    at,
    design_record,
    is_coherent,
    problem_of,
    random_designs,
    shipped_requirement,
    variant_name,
)
from support.shipped_problems import (
    put_together as enclosed,
)

REQUIREMENTS = ("pipe_inspection", "ceiling_watch", "sky_watch")
DESIGNS = 2
# Of a bundle this narrow the blur is that of the first order.
NARROW_MM = 1e-3


def coherent_designs(variant) -> Iterator[tuple[Requirement, Problem, dict[str, Array]]]:
    """Random designs that the formulas hold for, narrower than the nearest scene, with their requirement."""
    for name in REQUIREMENTS:
        requirement = shipped_requirement(name)
        problem = problem_of(requirement, variant)
        values = random_designs(problem, 2000, seed=3)
        sound = is_coherent(enclosed(problem, values)) & (values["radius"] < problem.specification.distances[0])
        for index in np.flatnonzero(sound)[:DESIGNS]:
            yield requirement, problem, at(values, index)


def number(value) -> float:
    return float(np.ravel(value)[0])


def amounts(constraints: tuple[Constraint, ...]) -> dict[tuple[str, str], list[float]]:
    """The values of constraints by kind and name, rising: one name may stand for both ends of a zone."""
    found = defaultdict(list)
    for item in constraints:
        found[item.kind, item.name].append(number(item.value))
    return {key: sorted(values) for key, values in found.items()}


class Traced:
    """The rays at both ends of each view's elevations, whatever the apertures cut off."""

    def __init__(self, design: Design):
        self.design = design
        self.instrument = build_instrument(design)
        self.hits: dict[str, dict[str, np.ndarray]] = {}
        self.image_radii: dict[str, np.ndarray] = {}
        self.sheets: dict[str, float] = {}
        for name, view in design.views.by_name.items():
            ends = np.radians(view.elevation_deg)
            sign = 1.0 if view.sense == "direct" else -1.0
            sent = pinhole_directions(2.0 * np.arctan(view.gain * np.tan(np.pi / 4 + sign * ends / 2)))
            trace = trace_sequential(self.instrument, self.instrument.path(view.path), sent, apertures=False)
            assert elevation_angles(trace.direction) == pytest.approx(ends, abs=1e-8)
            self.hits[name] = dict(zip(view.path, (hit[:, [0, 2]] for hit in trace.hits), strict=True))
            self.image_radii[name] = design.camera.focal_length_mm * np.abs(sent[:, 0] / sent[:, 2])
            points = [np.zeros((2, 3)), *trace.hits, trace.hits[-1] + trace.direction]
            legs = [(b - a) / np.linalg.norm(b - a, axis=1)[:, None] for a, b in pairwise(points)]
            for mirror, before, after, up in zip(view.path, legs, legs[1:], (1.0, -1.0), strict=False):
                # Tangents of half the angles with the axis before and after: a vertex sheet ends where they make 1.
                halves = np.hypot(before[:, 0], before[:, 1]) / (1.0 + up * before[:, 2])
                halves *= np.hypot(after[:, 0], after[:, 1]) / (1.0 - up * after[:, 2])
                self.sheets[mirror] = float(halves.max())

    def blurs(self, view: str) -> np.ndarray:
        """Diameters (3, 2) on the sensor in mm at lowest, middle slope and highest, near and far."""
        camera = self.design.camera
        # A random design may lie beyond its image.
        large = camera.model_copy(update={"width_px": 10 * camera.width_px, "image_circle_radius_px": None})
        design = self.design.model_copy(update={"camera": large})
        low, high = np.tan(np.radians(getattr(design.views, view).elevation_deg))
        elevations = np.degrees(np.arctan([low, (low + high) / 2, high]))
        distances = design.working_volume.distance_mm
        bundles = trace_bundles(design, view, elevations, distances, pupil_radius_mm=NARROW_MM)
        focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
        narrow = bundles.rms_radius_mm(camera.focal_length_mm, focus) / DISC_RMS_PER_DIAMETER
        return narrow * camera.pupil_radius_mm / NARROW_MM

    def pixels_per_radian(self, view: str) -> np.ndarray:
        """How far the image point moves on the sensor, mm per radian, at lowest, middle and highest slope."""
        record, focal = getattr(self.design.views, view), self.design.camera.focal_length_mm
        low, high = np.tan(np.radians(record.elevation_deg))
        elevations, step = np.arctan([low, (low + high) / 2, high]), 1e-6
        sign = 1.0 if record.sense == "direct" else -1.0

        def radius(elevation):
            return focal * np.tan(2.0 * np.arctan(record.gain * np.tan(np.pi / 4 + sign * elevation / 2)))

        return np.abs(radius(elevations + step) - radius(elevations - step)) / (2.0 * step)


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_image_rules_measure_traced_image_points(variant):
    tried = 0
    for requirement, problem, values in coherent_designs(variant):
        tried += 1
        design = design_record(requirement, problem, values)
        traced, camera = Traced(design), design.camera
        found = amounts(constraints_of(enclosed(problem, values), {}))
        outer, inner = ("upper", "lower") if design.views.upper.zone == "outer" else ("lower", "upper")
        rim = traced.image_radii[outer].max()
        assert found["image_circle", f"{outer} view inside the image circle"] == pytest.approx(
            [(camera.image_radius_mm - rim) / camera.pixel_pitch_mm], rel=1e-6
        )
        assert found["lens_barrel", "lens barrel clear of the light"] == pytest.approx(
            [camera.lens_radius_mm - camera.pupil_radius_mm - camera.lens_front_mm * rim / camera.focal_length_mm]
        )
        # Each zone ends half a blur beyond its chief ray, which lies at its lowest or at its highest elevation.
        blur_at = {
            view: traced.blurs(view)[[0, 2]].max(axis=1)[[int(np.argmin(radii)), int(np.argmax(radii))]]
            for view, radii in traced.image_radii.items()
        }
        free = (traced.image_radii[outer].min() - blur_at[outer][0] / 2) - (
            traced.image_radii[inner].max() + blur_at[inner][1] / 2
        )
        expected = free / camera.pixel_pitch_mm - requirement.manufacture.zone_gap_px
        assert found["zone_gap", "gap between the image zones"] == pytest.approx([expected], rel=1e-4, abs=1e-3)
    assert tried > 0


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_blur_rules_measure_traced_blur(variant):
    for requirement, problem, values in coherent_designs(variant):
        design = design_record(requirement, problem, values)
        traced, pitch = Traced(design), design.camera.pixel_pitch_mm
        found = amounts(constraints_of(enclosed(problem, values), {}))
        asked = requirement.sharpness
        for view in ("upper", "lower"):
            in_scene = math.radians(asked.max_blur_deg) * traced.pixels_per_radian(view)[:, None]
            allowed = np.minimum(asked.max_blur_px * pitch, in_scene)
            expected = np.sort(((allowed - traced.blurs(view)) / pitch).ravel())
            np.testing.assert_allclose(found["blur", f"blur of the {view} view"], expected, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_mirror_rules_measure_surfaces_and_traced_points(variant):
    for requirement, problem, values in coherent_designs(variant):
        design = design_record(requirement, problem, values)
        traced, asked = Traced(design), requirement.manufacture
        found = amounts(constraints_of(enclosed(problem, values), {}))
        for name, view in design.views.by_name.items():
            heights = traced.hits[name][view.path[0]][:, 1]
            key = ("nearest_mirror", f"axial distance of the {view.path[0]} mirror from the entrance pupil")
            assert found[key] == pytest.approx(sorted(heights - requirement.camera.nearest_mirror_mm), rel=1e-7)
            for mirror_name in view.path:
                mirror, radii = design.mirror(mirror_name), np.abs(traced.hits[name][mirror_name][:, 0])
                step = 1e-5
                rise = float(sag(mirror, mirror.outer_radius_mm + step) - sag(mirror, mirror.outer_radius_mm - step))
                slope = math.degrees(math.atan(abs(rise) / (2.0 * step)))
                expected = {
                    ("smallest_radius", f"smallest radius of the {mirror_name} mirror"): mirror.outer_radius_mm
                    - asked.smallest_mirror_radius_mm,
                    ("largest_diameter", f"largest diameter of the {mirror_name} mirror"): (
                        requirement.envelope.mirror_diameter_mm - 2.0 * mirror.outer_radius_mm
                    ),
                    ("steepest_slope", f"steepest slope of the {mirror_name} mirror"): asked.largest_slope_deg - slope,
                    ("used_ring", f"width of the used annulus of the {mirror_name} mirror"): float(np.ptp(radii)),
                    ("vertex_sheet", f"reflection on the vertex sheet of the {mirror_name} mirror"): (
                        1.0 - SHEET_MARGIN - traced.sheets[mirror_name]
                    ),
                }
                for key, value in expected.items():
                    assert found[key] == pytest.approx([value], rel=1e-6, abs=1e-6), key


@pytest.mark.parametrize("variant", [variant for variant in VARIANTS if variant.fold][::4], ids=variant_name)
def test_rules_of_a_folding_pair_measure_traced_points(variant):
    for requirement, problem, values in coherent_designs(variant):
        design = design_record(requirement, problem, values)
        hits = Traced(design).hits["lower"]
        found = amounts(constraints_of(enclosed(problem, values), {}))
        drop = hits["secondary"][:, 1] - hits["primary"][:, 1]
        assert found["primary_below_secondary", "primary below the secondary"] == pytest.approx(sorted(drop), rel=1e-6)
        primary, viewpoint = design.mirror("primary"), design.views.lower.viewpoint_mm
        # The lower focus of a primary that is met beyond the axis lies above its vertex.
        side = np.sign(hits["primary"][0, 0])
        key = ("primary_vertex_side", "primary's vertex on the correct side of the viewpoint")
        expected = side * (primary.vertex_mm - viewpoint) - SHORTEST_VERTEX_DISTANCE_MM
        assert found[key] == pytest.approx([expected], rel=1e-6)
        spares = {name: value for (kind, name), (value, *_) in found.items() if kind == "primary_kind"}
        assert bool(spares) == (primary.kind in {"hyperboloid", "ellipsoid"} and variant.fold.primary_gains is not None)
        if spares:
            (below,) = (value for name, value in spares.items() if "from below" in name)
            (above,) = (value for name, value in spares.items() if "from above" in name)
            low, high = variant.fold.primary_gains
            # A conic's inverse eccentricity is that of its conic constant, and its gain follows from both.
            gain = below + low
            assert ((1.0 - gain) / (1.0 + gain)) ** 2 == pytest.approx(-1.0 / primary.conic, rel=1e-6)
            assert below + above == pytest.approx(high - low)


@pytest.mark.parametrize("variant", VARIANTS[::7], ids=variant_name)
def test_the_envelope_holds_every_rim_on_face_and_back(variant):
    for requirement, problem, values in coherent_designs(variant):
        design = design_record(requirement, problem, values)
        box = {"top": np.array([211.0]), "bottom": np.array([-37.0]), "radius": np.array([90.0])}
        found = amounts(constraints_of(put_together(variant, values | box, problem.specification), {}))
        envelope = requirement.envelope
        assert found["envelope_height", "height of the mirror system"] == pytest.approx([envelope.height_mm - 248.0])
        assert found["envelope_diameter", "diameter of the mirror system"] == pytest.approx(
            [envelope.diameter_mm - 180.0]
        )
        assert found["encloses", "bottom encloses the lens front"] == pytest.approx(
            [design.camera.lens_front_mm + 37.0]
        )
        for mirror in design.mirrors:
            for rim, radius in (("inner", mirror.inner_radius_mm), ("outer", mirror.outer_radius_mm)):
                face = mirror.vertex_mm + float(sag(mirror, radius))
                back = face + (mirror.thickness_mm if mirror.faces == "down" else -mirror.thickness_mm)
                where = f"the {rim} rim of the {mirror.name} mirror"
                assert found["encloses", f"top encloses {where}"] == pytest.approx([211.0 - max(face, back)])
                assert found["encloses", f"bottom encloses {where}"] == pytest.approx([min(face, back) + 37.0])
            assert found["encloses", f"radius encloses the {mirror.name} mirror"] == pytest.approx(
                [90.0 - mirror.outer_radius_mm]
            )


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_fixed_numbers_are_missed_by_what_the_design_differs_from_them(variant):
    """Views before mirrors, as a requirement has them; lengths by their difference, the others by their share."""
    for requirement, problem, values in coherent_designs(variant):
        design = design_record(requirement, problem, values)
        system = enclosed(problem, values)
        kept, missed, expected = {}, {}, {}
        for name, view in design.views.by_name.items():
            kept |= {f"{name}.viewpoint_mm": view.viewpoint_mm, f"{name}.gain": view.gain}
            missed |= {f"{name}.viewpoint_mm": view.viewpoint_mm + 0.5, f"{name}.gain": view.gain / 1.02}
            expected |= {f"fixed viewpoint_mm of the {name} view": -0.5, f"fixed gain of the {name} view": 0.02}
        for mirror in design.mirrors:
            of = f"of the {mirror.name} mirror"
            kept[f"{mirror.name}.vertex_mm"] = mirror.vertex_mm
            missed[f"{mirror.name}.vertex_mm"] = mirror.vertex_mm - 0.25
            expected[f"fixed vertex_mm {of}"] = 0.25
            if mirror.radius_mm is not None:
                kept |= {f"{mirror.name}.radius_mm": mirror.radius_mm, f"{mirror.name}.conic": mirror.conic}
                missed[f"{mirror.name}.radius_mm"] = mirror.radius_mm * 1.03
                missed[f"{mirror.name}.conic"] = mirror.conic - 0.07
                expected |= {f"fixed radius_mm {of}": 0.03, f"fixed conic {of}": 0.07}
        rules = len(constraints_of(system, {}))
        for fixed, sizes in ((kept, dict.fromkeys(expected, 0.0)), (missed, expected)):
            found = constraints_of(system, fixed)[rules:]
            assert all(item.equality and item.kind == "fixed" for item in found)
            assert {item.name: number(item.value) for item in found} == pytest.approx(sizes, rel=1e-7, abs=1e-8)


def test_a_check_names_every_violation_in_its_own_unit():
    (variant,) = enumerate_variants(CONFIGURATIONS["folded-HyPl-Hy-upper_outer"])
    problem = problem_of(shipped_requirement("indoor_robot"), variant)
    values = random_designs(problem, 200, seed=1, f_number=CHIEF_RAYS_ALONE)
    evaluation = evaluate(problem, enclosed(problem, values))
    assert len(evaluation.names) == len(evaluation.units) == len(evaluation.amounts) == len(evaluation.violations)
    assert set(evaluation.units) <= {"mm", "px", "deg", "(a ratio)", "(in the gain)"}
    finite = np.isfinite(evaluation.amounts).all(axis=0)
    failing = evaluation.amounts[:, finite] < 0.0
    assert ((evaluation.violations[:, finite] > 0.0) == failing).all()


def test_light_must_travel_forwards():
    """Lines meet a primary above its secondary too: all else is kept, and the tracer sees nothing."""
    requirement = shipped_requirement("sky_watch")
    (variant,) = enumerate_variants(CONFIGURATIONS["folded-HyPl-Hy-upper_outer"])
    problem = problem_of(requirement, variant)
    backwards = {
        "baseline": 60.0,
        "focal_length": 12.0,
        "reciprocal_focus": 1.0 / 150.0,
        "f_number": CHIEF_RAYS_ALONE,
        "lower_viewpoint": 130.51498510854924,
        "lower_gain": 0.04626006806991695,
        "upper_gain": 0.03673565377855876,
        "secondary_height": 127.34634883977473,
        "secondary_inverse_gain": 1.0,
    }
    values = with_principal_distance({name: np.array([value]) for name, value in backwards.items()})
    evaluation = evaluate(problem, enclosed(problem, values))
    failing = {
        name for name, amount in zip(evaluation.names, evaluation.violations[:, 0], strict=True) if amount > 1e-6
    }
    assert failing == {"primary below the secondary"}
    assert not judge(design_record(requirement, problem, values)).passed
