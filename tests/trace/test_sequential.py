"""Rays along a path against exact identities: foci, the law of reflection, the vertex sheet, one ray in two traces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.closed_forms import conic_mirror, convex_ellipsoid_pair, folded_hypl_hy, gain, paraboloid
from support.instruments import instrument_of

# q, c (half of d (z_B - z_A)), facing; every row of the table of mirrors in docs/theory.md, section 2.
MIRRORS = [
    pytest.param(-0.4, 60.0, "down", id="concave hyperboloid"),
    pytest.param(0.0, 60.0, "down", id="plane facing down"),
    pytest.param(0.0, 60.0, "up", id="plane facing up"),
    pytest.param(0.85, 60.0, "down", id="convex hyperboloid facing down"),
    pytest.param(0.92, 90.0, "up", id="convex hyperboloid facing up"),
    pytest.param(1.2, 60.0, "down", id="ellipsoid facing down"),
    pytest.param(1.5, 60.0, "up", id="ellipsoid facing up"),
    pytest.param(-1.56, -177.0, "down", id="ellipsoid whose other focus the light never reaches"),
    pytest.param(1.02, -180.0, "up", id="convex ellipsoid facing up"),
]


@pytest.mark.parametrize(("q", "c", "faces"), MIRRORS)
def test_a_ray_through_one_focus_leaves_through_the_other(q, c, faces):
    d = 1.0 if faces == "down" else -1.0
    focus_a, focus_b = 10.0, 10.0 + 2.0 * d * c
    outer = 1.001 * abs(c * (1.0 - q * q) / (np.cos(0.12) - q) * np.sin(0.12))
    mirror = conic_mirror("mirror", focus_a, focus_b, q, faces, (0.0, outer))
    instrument = instrument_of(mirror)
    random = np.random.default_rng(5)
    psi, azimuth = random.uniform(0.02, 0.12, 200), random.uniform(0.0, 2.0 * np.pi, 200)
    directions = pinhole_directions(psi, azimuth) * [1.0, 1.0, d]
    origins = np.array([0.0, 0.0, focus_a]) - np.zeros((200, 1))
    if c * (1.0 - q * q) / (np.cos(0.12) - q) < 0.0:
        # The ray is aimed at the focus, and meets the mirror before it gets there.
        origins = origins - 600.0 * directions
    trace = trace_sequential(instrument, (0,), directions, origins)
    assert (trace.missed == -1).all()
    to_focus = np.array([0.0, 0.0, focus_b]) - trace.point
    assert np.linalg.norm(np.cross(to_focus, trace.direction), axis=1).max() < 1e-10
    # The gain law; a tangent counts negative when the ray leaves towards the other side of the axis.
    side = np.sign(np.sum(trace.direction[:, :2] * directions[:, :2], axis=1))
    cosine = -d * trace.direction[:, 2]
    t_b = side * np.sqrt((1.0 - cosine) / (1.0 + cosine))
    assert np.abs(np.tan(psi / 2.0) - gain(q) * t_b).max() < 1e-12


@pytest.mark.parametrize("faces", ["down", "up"])
def test_a_paraboloid_sends_rays_of_its_focus_along_the_axis(faces):
    vertex, radius = (80.0, -120.0) if faces == "down" else (-80.0, 120.0)
    instrument = instrument_of(paraboloid("mirror", vertex, radius, faces, (0.0, 90.0)))
    focus = np.array([0.0, 0.0, vertex + radius / 2.0])
    d = 1.0 if faces == "down" else -1.0
    directions = pinhole_directions(np.linspace(0.0, 1.2, 50), 0.7) * [1.0, 1.0, d]
    trace = trace_sequential(instrument, (0,), directions, focus + np.zeros((50, 3)))
    assert (trace.missed == -1).all()
    np.testing.assert_allclose(trace.direction, np.tile([0.0, 0.0, -d], (50, 1)), atol=1e-14)


@given(
    radius=st.floats(5.0, 1e9) | st.floats(-1e9, -5.0),
    conic=st.sampled_from([0.0, -1.0, -1.0 - 1e-12, -1.0 + 1e-12]) | st.floats(-5.0, 3.0),
    faces=st.sampled_from(["up", "down"]),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=60, deadline=None)
def test_hits_lie_on_the_vertex_sheet_and_obey_the_law_of_reflection(radius, conic, faces, seed):
    equator = abs(radius) / np.sqrt(1.0 + conic) if conic > -1.0 else np.inf
    outer = min(30.0, 0.95 * equator)
    instrument = instrument_of(
        {
            "name": "mirror",
            "kind": "ellipsoid",
            "vertex_mm": 50.0,
            "radius_mm": radius,
            "conic": conic,
            "inner_radius_mm": 0.3 * outer,
            "outer_radius_mm": outer,
            "thickness_mm": 0.0,
            "faces": faces,
        }
    )
    random, centre = np.random.default_rng(seed), np.array([0.0, 0.0, 50.0])
    origins = random.uniform(-60.0, 60.0, (100, 3)) + centre
    aims = random.uniform(-25.0, 25.0, (100, 3)) + centre
    directions = (aims - origins) / np.linalg.norm(aims - origins, axis=1)[:, None]
    trace = trace_sequential(instrument, (0,), directions, origins)
    met = trace.missed < 0
    assume(met.any())
    x, y, z = (trace.point[met] - [0.0, 0.0, 50.0]).T
    across = np.hypot(x, y)
    sheet = across**2 / radius / (1.0 + np.sqrt(1.0 - (1.0 + conic) * (across / radius) ** 2))
    gradient = np.stack([x / radius, y / radius, (1.0 + conic) * z / radius - 1.0], axis=1)
    # Compared along the normal, since a steep sheet magnifies an error in radius.
    assert np.abs((sheet - z) * np.abs(gradient[:, 2]) / np.linalg.norm(gradient, axis=1)).max() < 1e-12
    assert ((across >= 0.3 * outer) & (across <= outer)).all()
    normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
    sent, back = directions[met], trace.direction[met]
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), 1.0, atol=1e-13)
    np.testing.assert_allclose(np.sum(sent * normal, axis=1), -np.sum(back * normal, axis=1), atol=1e-13)
    np.testing.assert_allclose(np.sum(np.cross(sent, normal) * back, axis=1), 0.0, atol=1e-13)
    # Met from the reflecting side.
    towards = np.sum(sent * normal * np.sign(normal[:, 2:]), axis=1) * (1.0 if faces == "up" else -1.0)
    assert (towards < 0.0).all()


def test_the_other_sheet_of_a_hyperboloid_is_never_met():
    mirror = conic_mirror("mirror", 0.0, 100.0, 0.8, "down", (0.0, 500.0), thickness=0.0)
    instrument = instrument_of(mirror, lens_radius_mm=0.1, body_radius_mm=0.1)
    # The other sheet opens downwards below; rays that go down from the pinhole cross it and nothing else.
    directions = pinhole_directions(np.linspace(2.2, np.pi, 200), 0.4)
    other_vertex = 2.0 * 50.0 - mirror["vertex_mm"]
    origins = np.tile([0.0, 0.0, other_vertex + 5.0], (200, 1))
    assert (trace_sequential(instrument, (0,), directions, origins).missed == 0).all()
    assert (trace_first_hits(instrument, directions, origins).status == Status.ESCAPED).all()


def test_a_ray_that_gets_through_is_the_same_ray_in_both_traces():
    design = convex_ellipsoid_pair()
    instrument = build_instrument(design)
    path = instrument.path(design.views.lower.path)
    directions = pinhole_directions(np.linspace(0.0, 0.3, 400), 1.1)
    first, sequential = trace_first_hits(instrument, directions), trace_sequential(instrument, path, directions)
    through = compare_with_path(first, path).status == Status.OK
    assert through.sum() > 50
    assert (sequential.missed[through] == -1).all()
    np.testing.assert_allclose(first.exit_direction[through], sequential.direction[through], atol=1e-14)
    np.testing.assert_allclose(first.exit_point[through], sequential.point[through], atol=1e-12)


@pytest.mark.parametrize("build", [folded_hypl_hy, convex_ellipsoid_pair])
def test_rays_of_the_pinhole_are_the_same_in_their_meridional_planes_and_in_space(build):
    design = build()
    instrument = build_instrument(design)
    random = np.random.default_rng(8)
    directions = pinhole_directions(random.uniform(0.0, 0.4, 3000), random.uniform(0.0, 2.0 * np.pi, 3000))
    # Along the axis, where a ray has no azimuth, and straight to the side, past every mirror.
    directions[:2] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    in_space = np.zeros_like(directions)
    for view in (design.views.upper, design.views.lower):
        path = instrument.path(view.path)
        for apertures in (True, False):
            flat = trace_sequential(instrument, path, directions, apertures=apertures)
            full = trace_sequential(instrument, path, directions, in_space, apertures=apertures)
            np.testing.assert_array_equal(flat.missed, full.missed)
            np.testing.assert_allclose(flat.direction, full.direction, atol=1e-13)
            for hit, same in zip(flat.hits, full.hits, strict=True):
                np.testing.assert_allclose(hit, same, rtol=1e-12, atol=1e-12)
    for starts_in_lens in (False, True):
        flat_first, full_first = (
            trace_first_hits(instrument, directions, origins, starts_in_lens=starts_in_lens)
            for origins in (None, in_space)
        )
        for name in ("status", "leg", "element", "sequence"):
            np.testing.assert_array_equal(getattr(flat_first, name), getattr(full_first, name))
        for name in ("hits", "blocked_at", "exit_point", "exit_direction"):
            np.testing.assert_allclose(getattr(flat_first, name), getattr(full_first, name), atol=1e-11)
    assert len(np.unique(flat_first.sequence, axis=0)) >= 2


def test_batches_of_any_size_give_the_same_rays():
    design = folded_hypl_hy()
    instrument = build_instrument(design)
    directions = pinhole_directions(np.linspace(0.0, 0.25, 20001), 0.3)
    together = trace_first_hits(instrument, directions)
    few = trace_first_hits(instrument, directions[4000:4200])
    np.testing.assert_array_equal(together.status[4000:4200], few.status)
    np.testing.assert_array_equal(together.hits[4000:4200], few.hits)
    assert trace_first_hits(instrument, np.empty((0, 3))).status.size == 0
    path = instrument.path(design.views.lower.path)
    sequential = trace_sequential(instrument, path, directions)
    np.testing.assert_array_equal(
        sequential.direction[4000:4200], trace_sequential(instrument, path, directions[4000:4200]).direction
    )
