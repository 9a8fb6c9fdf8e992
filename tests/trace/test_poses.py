"""Mirrors out of their nominal place: what turning and shifting them does to rays."""

from __future__ import annotations

import numpy as np

from designer.design import Design
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import trace_first_hits
from designer.trace.instrument import Pose, build_instrument
from designer.trace.sequential import trace_sequential
from support.closed_forms import conic_mirror, folded_hypl_hy
from support.instruments import rotation_matrix


def test_turning_the_whole_system_turns_the_result():
    design = folded_hypl_hy()
    random = np.random.default_rng(3)
    turn = rotation_matrix(random, 2.0)
    poses = {}
    for mirror in design.mirrors:
        vertex = np.array([0.0, 0.0, mirror.vertex_mm])
        poses[mirror.name] = Pose(turn, turn @ vertex - vertex)
    level, turned = build_instrument(design), build_instrument(design, poses)
    psi, azimuth = random.uniform(0.058, 0.104, 500), random.uniform(0.0, 6.0, 500)
    directions = pinhole_directions(psi, azimuth)
    path = level.path(design.views.lower.path)
    straight = trace_sequential(level, path, directions)
    crooked = trace_sequential(turned, path, directions @ turn.T)
    assert (straight.missed == -1).all()
    assert (crooked.missed == -1).all()
    np.testing.assert_allclose(crooked.direction, straight.direction @ turn.T, atol=1e-13)
    np.testing.assert_allclose(crooked.point, straight.point @ turn.T, atol=1e-11)
    first = trace_first_hits(turned, directions @ turn.T)
    np.testing.assert_allclose(first.hits[:, 1], straight.point @ turn.T, atol=1e-11)


def test_an_identity_pose_changes_nothing():
    design = folded_hypl_hy()
    poses = {mirror.name: Pose(np.eye(3), np.zeros(3)) for mirror in design.mirrors}
    directions = pinhole_directions(np.linspace(0.0, 0.25, 300), 0.3)
    plain, posed = (trace_first_hits(build_instrument(design, p), directions) for p in (None, poses))
    np.testing.assert_array_equal(plain.status, posed.status)
    np.testing.assert_array_equal(plain.element, posed.element)
    np.testing.assert_allclose(plain.exit_direction, posed.exit_direction, atol=1e-14)


def test_tilting_a_plane_turns_the_reflected_ray_by_twice_the_angle():
    plane = conic_mirror("mirror", 0.0, 100.0, 0.0, "down", (0.0, 30.0))
    view = folded_hypl_hy()
    design = Design.model_validate(
        {
            **view.model_dump(by_alias=True),
            "mirrors": [{**plane, "name": n} for n in ("secondary", "primary", "direct")],
        }
    )
    tilt = 0.01
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    instrument = build_instrument(design, {"direct": Pose(turn, np.zeros(3))})
    trace = trace_sequential(instrument, (2,), [[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(trace.direction[0], [-np.sin(2 * tilt), 0.0, -np.cos(2 * tilt)], atol=1e-15)
