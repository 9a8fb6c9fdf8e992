"""A board in front of a scene: every module is where the pose says, and what is behind it stays."""

from __future__ import annotations

import numpy as np
import pytest

from designer.calibration.target import MODULES, make_target, modules_of
from designer.calibration.target_pose import facing_pose
from designer.imaging.render.scenes.library import build_world
from designer.imaging.render.scenes.printed_board import BLACK, WHITE, with_board
from designer.imaging.render.scenes.world import first_surfaces, radiance
from support.imaging_designs import prototype

TARGET = make_target(7, 5, 40.0)


def seen(world, eye: np.ndarray, points: np.ndarray, spread_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Radiance and distance behind rays from an eye towards points (n, 3)."""
    ahead = points - eye
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    hits = first_surfaces(world, np.tile(eye[:, None], (1, len(points))), np.ascontiguousarray(ahead.T))
    return radiance(world, hits, np.full(len(points), spread_mm)), hits.distance


def test_every_module_is_where_the_pose_says():
    office = build_world("office", prototype(), "natural")
    pose = facing_pose(TARGET.size_mm, 40.0, 600.0, 90.0, (20.0, -15.0, 35.0))
    module = TARGET.square_mm / MODULES
    modules = modules_of(TARGET)
    world = with_board(office, modules, module, pose.turn, pose.place_mm)
    rows, columns = (part.ravel() for part in np.indices(modules.shape))
    points = pose.points(np.column_stack([(columns + 0.5) * module, (rows + 0.5) * module, np.zeros(rows.size)]))
    eye = np.array([0.0, 0.0, 100.0])
    found, distance = seen(world, eye, points, 0.2)
    assert np.allclose(distance, np.linalg.norm(points - eye, axis=1))
    # A lamp lights the board as a whole; single modules differ by what is printed on them alone.
    white = modules[rows, columns] > 0
    assert np.ptp(found[white]) < 0.02
    assert np.ptp(found[~white]) < 0.02
    assert found[~white].mean() / found[white].mean() == pytest.approx(BLACK / WHITE, rel=0.02)
    # Seen by who looks from far away, it is grey: between the two by the share that is white.
    coarse, _ = seen(world, eye, points[:1] * 0.0 + points.mean(axis=0), 400.0)
    assert BLACK < coarse[0] < WHITE


def test_nothing_changes_beside_the_board():
    office = build_world("office", prototype(), "natural")
    pose = facing_pose(TARGET.size_mm, 40.0, 600.0, 90.0)
    world = with_board(office, modules_of(TARGET), 5.0, pose.turn, pose.place_mm)
    azimuth = np.radians(np.linspace(90.0, 350.0, 200))
    points = np.column_stack([900.0 * np.cos(azimuth), 900.0 * np.sin(azimuth), 50.0 + 0.0 * azimuth])
    eye = np.array([0.0, 0.0, 100.0])
    assert np.array_equal(seen(world, eye, points, 1.0)[0], seen(office, eye, points, 1.0)[0])


def test_a_board_needs_a_scene_of_materials():
    with pytest.raises(ValueError, match="natural finishes"):
        with_board(build_world("office", prototype()), modules_of(TARGET), 5.0, np.eye(3), np.zeros(3))
