"""Clearances against brute force: extents against sampled points, separations against the tracer's verdict."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.design import Design
from designer.optics.clearance import PIECES, FaceRows, Pairs, SolidRows, pair_up, separations
from designer.optics.conic import FocalConic, Surface
from designer.optics.layout import Layout, Leg, LegEnd, PlacedMirror, Solid
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import build_instrument
from designer.verify.judge import judge
from designer.verify.solids import contact_problems
from support.shipped_problems import (
    CHIEF_RAYS_ALONE,
    VARIANTS,
    at,
    design_record,
    is_coherent,
    problem_of,
    put_together,
    random_designs,
    shipped_requirement,
    variant_name,
)

angles = st.floats(-3.2, 3.2)
# Within this of zero, sampled rays and exact separations need not agree.
BAND_MM = 0.02
RAYS = 301


@given(
    st.one_of(st.floats(1.01, 40.0), st.just(1.0), st.floats(-40.0, 0.99)),
    st.floats(10.0, 150.0),
    st.sampled_from([-1.0, 1.0]),
    st.floats(0.0, 0.9),
    st.floats(0.05, 0.95),
    angles,
)
def test_extents_are_the_largest_over_the_whole_face(tangent_ratio, distance, side, start, share, angle):
    conic = FocalConic(0.0, distance, tangent_ratio)
    limit = 0.97 * min(1.0, abs(tangent_ratio) ** -0.5 if tangent_ratio else 1.0)
    tangents = limit * np.array([start * share, share])
    inner, outer = (conic.point(tangent)[0] for tangent in tangents)
    face = FaceRows(conic.surface, np.array([[inner]]), np.array([[outer]]), np.array([[side]]))
    direction = (np.cos(angle), np.sin(angle))
    radii = np.linspace(inner, outer, 20001)
    along = direction[0] * side * radii + direction[1] * conic.surface.height(radii)
    extent = float(face.extent(direction)[0, 0])
    assert extent >= along.max() - 1e-9
    assert extent == pytest.approx(along.max(), abs=1e-4)
    solid = SolidRows(face, np.array([[2.0]]))
    assert float(solid.extent(direction)[0, 0]) == pytest.approx(extent + max(2.0 * direction[1], 0.0), abs=1e-12)


def blocked_pairs(design: Design) -> set[tuple[str, int, str, int]]:
    """What the tracer finds in the way of asked light: view, mirrors met before, solid, and its side of the axis."""
    instrument = build_instrument(design)
    found = set()
    for name, view in (("upper", design.views.upper), ("lower", design.views.lower)):
        sign = 1.0 if view.sense == "direct" else -1.0
        elevations = np.radians(np.linspace(*view.elevation_deg, RAYS))
        psi = 2.0 * np.arctan(view.gain * np.tan(np.pi / 4 + sign * elevations / 2))
        trace = trace_first_hits(instrument, pinhole_directions(psi))
        report = compare_with_path(trace, instrument.path(view.path))
        for ray in np.flatnonzero(report.status == Status.BLOCKED):
            leg, element = int(report.leg[ray]), instrument.elements[report.element[ray]]
            met_mirror = trace.sequence[ray, leg] >= 0
            place = trace.hits[ray, leg] if met_mirror else trace.blocked_at[ray]
            solid = element.split(" of ")[-1].replace("lens barrel", "lens").replace("camera body", "body")
            side = 1 if solid in {"lens", "body"} else int(np.sign(place[0]))
            found.add((name, leg, solid, side))
    return found


def clearances(layout: Layout) -> tuple[dict[tuple[str, int, str, int], float], dict[frozenset[str], float]]:
    """Best separation of one design by view, mirrors met before, solid and side; and of solids by their names.

    A leg that crosses the axis is split there: the lesser of its two parts counts.
    """
    pairs = pair_up(layout)
    light, bodies = separations(layout, pairs)
    best = light.max(axis=0)[:, 0]
    legs: dict[tuple[str, int, str, int], float] = {}
    before = {"upper": -1, "lower": -1}
    met: dict[int, int] = {}
    for index, leg in enumerate(layout.legs):
        if "focus" not in leg.name.split(" -> ")[0]:
            before[leg.view] += 1
        met[index] = before[leg.view]
    for (leg_index, solid_index), separation in zip(pairs.leg_solid, best, strict=True):
        solid = pairs.solids[solid_index]
        key = (pairs.legs[leg_index].view, met[leg_index], solid.name, solid.side)
        legs[key] = min(legs.get(key, np.inf), float(separation))
    solids: dict[frozenset[str], float] = {}
    for (first, second), separation in zip(pairs.solid_solid, bodies.max(axis=0)[:, 0], strict=True):
        names = frozenset({pairs.solids[first].name, pairs.solids[second].name})
        # Of a primary's pieces the nearest counts.
        solids[names] = min(solids.get(names, np.inf), float(separation))
    return legs, solids


def touching(design: Design) -> set[frozenset[str]]:
    """The pairs of solids that the tracer's sections find in contact."""
    found = set()
    for problem in contact_problems(design):
        words = problem.replace("lens barrel", "lens").replace("camera body", "body").split()
        found.add(frozenset({words[0], words[2]}))
    return found


def stands_on(leg: Leg, solid: Solid) -> bool:
    """Whether an end ray starts or ends on the very face of a solid."""
    for across, along in (*leg.start.points, *leg.end.points):
        radius = solid.side * float(np.ravel(across)[0])
        inner, outer = (float(np.ravel(edge)[0]) for edge in (solid.inner_radius, solid.outer_radius))
        off = float(np.ravel(along)[0]) - float(np.ravel(solid.surface.height(np.array([radius])))[0])
        if inner - 1e-9 <= radius <= outer + 1e-9 and abs(off) < 1e-7:
            return True
    return False


@pytest.mark.parametrize("variant", VARIANTS[::3], ids=variant_name)
def test_every_pair_counts_but_those_that_meet_on_purpose(variant):
    """A leg and the face it starts or ends on; the first leg and the camera; lens and body, which are one piece."""
    problem = problem_of(shipped_requirement("pipe_inspection"), variant)
    values = random_designs(problem, 4000, seed=7)
    sound = np.flatnonzero(is_coherent(put_together(problem, values)))
    for index in sound[:2]:
        layout = put_together(problem, at(values, index)).layout
        pairs = pair_up(layout)
        camera = {"lens", "body"}
        expected = {
            (i, j)
            for i, leg in enumerate(layout.legs)
            for j, solid in enumerate(layout.solids)
            if not (solid.name in camera and leg is next(one for one in layout.legs if one.view == leg.view))
            and not (solid.name not in camera and stands_on(leg, solid))
        }
        assert set(pairs.leg_solid) == expected
        # Solids are rings: each pair of them once, but for a primary that clears the camera piece by piece.
        bodies = Counter(frozenset({pairs.solids[i].name, pairs.solids[j].name}) for i, j in pairs.solid_solid)
        assert all(bodies[pair] == (PIECES if "primary" in pair and pair & camera else 1) for pair in bodies)
        rings = {solid.name for solid in layout.solids}
        assert set(bodies) == {frozenset(pair) for pair in combinations(rings, 2)} - {frozenset(camera)}


def speck(place: np.ndarray) -> Solid:
    """A solid so small that it is a point in the meridional plane."""
    return Solid("speck", 1, Surface(place[1], 0.0, 0.0), place[0], place[0], 0.0)


def light_through(corners: np.ndarray) -> Leg:
    """A leg without mirrors: from the first two corners to the other two, each ray from one to the next but one."""
    ends = [LegEnd(tuple(tuple(point) for point in pair)) for pair in (corners[:2], corners[2:])]
    return Leg("upper", "here -> there", *ends)


def best_separation(leg: Leg, first: Solid, second: Solid) -> tuple[float, float]:
    """The largest of a leg from the first solid, and of the two solids from each other."""
    layout = Layout((), (leg,), (first, second))
    light, bodies = separations(layout, Pairs((leg,), layout.solids, ((0, 0),), ((0, 1),)))
    return float(light.max()), float(bodies.max())


FAR_AWAY = speck(np.array([900.0, -900.0]))


@pytest.mark.parametrize("edge", [(0, 1), (2, 3), (0, 2), (1, 3)], ids=["start", "end", "inner ray", "outer ray"])
def test_a_point_beside_an_edge_of_the_light_is_as_far_from_it_as_from_its_line(edge):
    corners = np.array([[10.0, 0.0], [14.0, 1.0], [9.0, 20.0], [18.0, 23.0]])
    first, second = corners[list(edge)]
    along = (second - first) / np.linalg.norm(second - first)
    outwards = np.array([along[1], -along[0]])
    outwards *= np.sign(outwards @ (first - corners.mean(axis=0)))
    place = (first + second) / 2.0 + 3.0 * outwards
    separation, _ = best_separation(light_through(corners), speck(place), FAR_AWAY)
    assert separation == pytest.approx(3.0, abs=1e-9)


@pytest.mark.parametrize(
    ("place", "apart"), [((15.0, 35.0), 3.0), ((15.0, 26.0), 4.0), ((24.0, 31.0), 4.0), ((7.0, 31.0), 3.0)], ids=str
)
def test_a_point_over_under_around_or_within_a_flat_ring_is_as_far_as_it_looks(place, apart):
    """From 10 to 20 mm off the axis and from 30 to 32 mm high."""
    ring = Solid("ring", 1, Surface(30.0, 0.0, 0.0), 10.0, 20.0, 2.0)
    point = np.array(place)
    light = light_through(np.tile(point, (4, 1)))
    assert best_separation(light, ring, speck(point)) == pytest.approx((apart, apart), abs=1e-9)
    _, turned = best_separation(light, speck(point), ring)
    assert turned == pytest.approx(apart, abs=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_a_point_inside_a_bowl_is_as_far_from_it_as_from_the_chord_between_its_rims(side):
    bowl = Solid("bowl", side, Surface(50.0, 0.02, 0.0), 10.0, 40.0, -5.0)
    inner, outer = (np.array([side * radius, 50.0 + 0.01 * radius**2]) for radius in (10.0, 40.0))
    along = (outer - inner) / np.linalg.norm(outer - inner)
    place = (inner + outer) / 2.0 + 4.0 * np.array([-along[1], along[0]]) * side
    of_light, of_solids = best_separation(light_through(np.tile(place, (4, 1))), bowl, speck(place))
    assert (of_light, of_solids) == pytest.approx((4.0, 4.0), abs=1e-9)
    _, turned = best_separation(light_through(np.tile(place, (4, 1))), speck(place), bowl)
    assert turned == pytest.approx(4.0, abs=1e-9)


def numbers(values) -> np.ndarray:
    return np.array([float(np.ravel(value)[0]) for value in values])


def points_of_leg(leg: Leg) -> np.ndarray:
    """Points (n, 2) all over the light of a leg, from where it starts to where it ends."""
    share = np.linspace(0.0, 1.0, 7)[:, None]
    ends = []
    for end in (leg.start, leg.end):
        first, second = (numbers(point) for point in end.points)
        line = first + share * (second - first)
        if end.surface is not None:
            line[:, 1] = end.surface.height(np.abs(line[:, 0]))
        ends.append(line)
    along = np.linspace(0.0, 1.0, 41)[:, None, None]
    return (ends[0] + along * (ends[1] - ends[0])).reshape(-1, 2)


def points_of_solid(solid: Solid) -> np.ndarray:
    """Points (n, 2) on face and back of a solid, and on its rims."""
    inner, outer, depth = numbers((solid.inner_radius, solid.outer_radius, solid.depth))
    radii = np.linspace(inner, outer, 31)
    face = np.stack([solid.side * radii, np.broadcast_to(solid.surface.height(radii), radii.shape)], axis=-1)
    walls = [face[end] + np.array([0.0, share * depth]) for end in (0, -1) for share in np.linspace(0.0, 1.0, 9)]
    return np.concatenate([face, face + np.array([0.0, depth]), walls])


@pytest.mark.parametrize("variant", VARIANTS[::4], ids=variant_name)
def test_no_separation_exceeds_the_distance_of_any_two_points(variant):
    """Along whatever direction: a plane between two bodies leaves no more room than they have."""
    problem = problem_of(shipped_requirement("pipe_inspection"), variant)
    values = random_designs(problem, 4000, seed=7)
    for index in np.flatnonzero(is_coherent(put_together(problem, values)))[:3]:
        layout = put_together(problem, at(values, index)).layout
        pairs = pair_up(layout)
        light, bodies = separations(layout, pairs)
        legs, solids = [points_of_leg(leg) for leg in layout.legs], [points_of_solid(one) for one in pairs.solids]
        for claimed, ones, rows in ((light, legs, pairs.leg_solid), (bodies, solids, pairs.solid_solid)):
            for (i, j), of_pair in zip(rows, claimed[:, :, 0].T, strict=True):
                apart = np.linalg.norm(ones[i][:, None] - solids[j][None], axis=-1).min()
                assert of_pair.max() <= apart + 1e-6, (i, j, int(of_pair.argmax()))


@given(st.floats(0.0, 90.0), st.floats(0.2, 5.0))
def test_two_rims_are_as_far_apart_as_they_are(angle, apart):
    """A flat ring diagonally above another: nearest are two rims, and no chord is normal to the line between them."""
    across, along = apart * np.cos(np.radians(angle)), apart * np.sin(np.radians(angle))
    inner = Solid("inner", 1, Surface(30.0, 0.0, 0.0), 5.0, 10.0, 1.0)
    outer = Solid("outer", 1, Surface(31.0 + along, 0.0, 0.0), 10.0 + across, 20.0, 1.0)
    _, separation = best_separation(light_through(np.tile([900.0, -900.0], (4, 1))), inner, outer)
    assert 0.99 * apart <= separation <= apart + 1e-9


@pytest.mark.parametrize("lens_radius", [6.87, 5.5, 3.0])
def test_a_lens_in_the_hollow_of_a_steep_primary_is_as_far_from_it_as_it_is(lens_radius):
    """The primary and the lens of a random requirement, where the convex hull claimed 0.4 mm more than there is."""
    curvature, conic = -1.6845, -1.1355
    surface = Surface(31.6282, curvature, (1.0 + conic) * curvature**2)
    primary = PlacedMirror("primary", -1, surface, (6.0, 35.0), 5.35, 35.96, 1.75)
    lens = Solid("lens", 1, Surface(5.76, 0.0, 0.0), -lens_radius, lens_radius, -24.4)
    body = Solid("body", 1, Surface(-18.64, 0.0, 0.0), -lens_radius, lens_radius, -1000.0)
    layout = Layout((primary,), (light_through(np.tile([900.0, -900.0], (4, 1))),), (lens, body))
    # Nearest are the lens's rim and the shell's back.
    radii = np.linspace(5.35, 35.96, 200_001)
    back = np.stack([radii, surface.height(radii) - 1.75], axis=-1)
    apart = np.linalg.norm(back - [lens_radius, 5.76], axis=-1).min()
    pairs = pair_up(layout)
    _, bodies = separations(layout, pairs)
    of_lens = [row for row, (_, other) in enumerate(pairs.solid_solid) if pairs.solids[other].name == "lens"]
    separation = float(bodies.max(axis=0)[of_lens].min())
    assert apart - 0.05 <= separation <= apart + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pipe_inspection", "ceiling_watch"])
def test_separations_agree_with_the_tracer(name, record_property):
    requirement = shipped_requirement(name)
    count: Counter[str] = Counter()
    for variant in VARIANTS:
        problem = problem_of(requirement, variant)
        # The tracer follows chief rays here.
        values = random_designs(problem, 2500, seed=7, f_number=CHIEF_RAYS_ALONE)
        reach = problem.specification.reach_radius
        sound = is_coherent(put_together(problem, values)) & (values["radius"] < reach)
        for index in np.flatnonzero(sound)[:6]:
            one = at(values, index)
            design = design_record(requirement, problem, one)
            legs, solids = clearances(put_together(problem, one).layout)
            blocked, contacts = blocked_pairs(design), touching(design)
            where = f"{variant_name(variant)}, draw {index}"
            # Never the dangerous kind: whatever the tracer finds in the way is a pair, and not called apart.
            for pair in blocked:
                assert pair in legs, f"{where}: no separation is computed for {pair}"
                assert legs[pair] < BAND_MM, f"{where}: {pair} is called {legs[pair]:.3g} mm apart"
            for pair in contacts:
                assert solids[pair] < BAND_MM, f"{where}: {pair} are called {solids[pair]:.3g} mm apart"
            count["pairs"] += len(legs) + len(solids)
            count["blocked"] += len(blocked) + len(contacts)
            count["apart"] += sum(value > BAND_MM for value in (*legs.values(), *solids.values()))
            called = {pair for pair, value in legs.items() if value < -BAND_MM}
            hindered = {view for view, *_ in blocked}
            count["conservative light"] += sum(view not in hindered for view, *_ in called)
            count["conservative solids"] += sum(
                value < -BAND_MM for key, value in solids.items() if key not in contacts
            )
    for key, number in count.items():
        record_property(key, number)
    # The other kind costs at most a good design: pairs called overlapping that are apart.
    conservative = count["conservative light"] + count["conservative solids"]
    assert count["blocked"] > 100
    assert conservative < 0.01 * count["blocked"]


@pytest.mark.slow
def test_designs_called_clear_pass_the_tracer():
    """No solid hides asked light or touches another, and the traced rays keep the separation that was computed."""
    judged = 0
    for name in ("indoor_robot", "sky_watch"):
        requirement = shipped_requirement(name)
        for variant in VARIANTS:
            problem = problem_of(requirement, variant)
            values = random_designs(problem, 2000, seed=11)
            assembly = put_together(problem, values)
            sound = np.flatnonzero(is_coherent(assembly) & (values["radius"] < problem.specification.reach_radius))
            if not sound.size:
                continue
            kept = {key: value[sound] for key, value in values.items()}
            layout = put_together(problem, kept).layout
            light, bodies = separations(layout, pair_up(layout))
            least = np.minimum(light.max(axis=0).min(axis=0), bodies.max(axis=0).min(axis=0))
            for index in np.flatnonzero(least > BAND_MM)[:3]:
                design, where = design_record(requirement, problem, at(kept, index)), f"{name} {variant_name(variant)}"
                verdict = judge(design)
                for view in verdict.views.values():
                    assert [blockage for blockage in view.blockages if blockage.is_asked] == [], where
                    assert view.clearance_mm >= least[index] - 1e-6, where
                assert contact_problems(design) == [], where
                judged += 1
    assert judged > 60
