"""Reconstruction: from rows back to points, their uncertainty against noisy projections, and what is written."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.design import PerView
from designer.imaging.stereo.cloud import floor_plan, view_of_cloud
from designer.imaging.stereo.panorama import panorama_grid, view_images
from designer.imaging.stereo.placement import ImagePlacement
from designer.imaging.stereo.ply import write_ply
from designer.imaging.stereo.reconstruction import (
    PointCloud,
    depth_shifts_per_scale,
    disparity_from_distance,
    distance_from_disparity,
    distance_map,
    reconstruct,
    triangulate,
)
from support.imaging_designs import SENSES, SIGNS, prototype, with_views


@given(
    st.sampled_from(SIGNS),
    st.sampled_from(SENSES),
    st.sampled_from(["spherical", "cylindrical"]),
    st.floats(50, 20000),
    st.floats(-60, 60),
    st.floats(-np.pi, np.pi),
    st.floats(-3, 3),
)
def test_a_point_comes_back_from_its_two_pixels(signs, senses, sampling, distance, elevation_deg, azimuth, turn):
    design = with_views(prototype(), signs, senses)
    grid, images = panorama_grid(design, sampling), view_images(design, ImagePlacement((803.2, 590.1), turn, 1.03))
    middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2
    height = middle + distance * np.tan(np.radians(elevation_deg))
    point = np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), height])
    rows, columns = {}, {}
    for name, image in images.items():
        slope, seen_azimuth = image.direction_of(*image.project(point))
        rows[name], columns[name] = grid.row(name, slope), grid.column(seen_azimuth)
    assert (columns["upper"] - columns["lower"] + 900) % 1800 - 900 == pytest.approx(0, abs=1e-6)
    slopes = {name: grid.slope(name, row) for name, row in rows.items()}
    back, back_height = triangulate(PerView(**slopes), design.views.lower.viewpoint_mm, design.baseline_mm)
    # The disparity is a difference of rows that hold some 1e-16 relative error each: it limits a far point.
    assert back == pytest.approx(distance, rel=1e-9)
    assert back_height == pytest.approx(height, abs=1e-9 * np.hypot(distance, height))
    found_azimuth = grid.azimuth(columns["upper"])
    assert np.hypot(np.cos(found_azimuth) - np.cos(azimuth), np.sin(found_azimuth) - np.sin(azimuth)) < 1e-9
    from_rows = distance_from_disparity(grid, rows["upper"], rows["upper"] - rows["lower"], design.baseline_mm)
    assert from_rows == pytest.approx(distance, rel=1e-9)


@given(st.floats(0, 170), st.floats(200, 20000), st.sampled_from(["spherical", "cylindrical"]))
def test_disparity_and_distance_are_inverse(row, distance, sampling):
    grid = panorama_grid(prototype(), sampling)
    disparity = disparity_from_distance(grid, row, distance, 100.0)
    assert distance_from_disparity(grid, row, disparity, 100.0) == pytest.approx(distance, rel=1e-9)


@given(st.floats(0, 170), st.floats(200, 20000))
def test_disparity_of_cylindrical_panoramas_is_inverse_to_distance_in_every_row(row, distance):
    grid = panorama_grid(prototype(), "cylindrical")
    offset = (grid.top_lower - grid.top_upper) / grid.step
    disparity = disparity_from_distance(grid, row, distance, 100.0)
    assert disparity + offset == pytest.approx(100.0 / distance / grid.step, rel=1e-9)


@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_the_fast_map_is_the_exact_one(sampling):
    grid = panorama_grid(prototype(), sampling)
    rng = np.random.default_rng(0)
    rows = np.arange(grid.rows)
    true = rng.uniform(800, 6000, (50, grid.rows))
    disparities = disparity_from_distance(grid, rows, true, 100.0).astype(np.float32)
    disparities[3, 4] = np.nan
    fast = distance_map(grid, disparities, 100.0)
    exact = distance_from_disparity(grid, rows, disparities, 100.0)
    assert np.isnan(fast[3, 4])
    known = np.isfinite(disparities)
    np.testing.assert_allclose(fast[known], exact[known], rtol=3e-5)
    assert np.isinf(distance_map(grid, disparities - 100, 100.0)[known]).all()


def cloud_of(distance, disparities_at, noise_px=None, design=None):
    design = design or prototype()
    grid = panorama_grid(design)
    disparities = np.full((grid.columns, grid.rows), np.nan, np.float32)
    for column, row in disparities_at:
        disparities[column, row] = disparity_from_distance(grid, row, distance, design.baseline_mm)
    colours = np.arange(grid.rows * grid.columns * 3, dtype=np.uint8).reshape(grid.rows, grid.columns, 3)
    return grid, colours, reconstruct(design, grid, disparities, colours, noise_px)


def test_points_lie_in_their_columns_and_carry_their_colours():
    grid, colours, cloud = cloud_of(2000.0, [(0, 60), (450, 70), (1799, 80)])
    np.testing.assert_array_equal(cloud.columns, [0, 450, 1799])
    np.testing.assert_allclose(np.hypot(*cloud.positions_mm[:, :2].T), 2000.0, rtol=2e-5)
    azimuths = np.arctan2(cloud.positions_mm[:, 1], cloud.positions_mm[:, 0])
    np.testing.assert_allclose(azimuths, grid.azimuth(cloud.columns), atol=1e-9)
    heights = prototype().views.upper.viewpoint_mm + 2000.0 * grid.slope("upper", cloud.rows)
    np.testing.assert_allclose(cloud.positions_mm[:, 2], heights, atol=0.02)
    np.testing.assert_array_equal(cloud.colours, colours[cloud.rows, cloud.columns, ::-1])


@pytest.mark.parametrize("signs", SIGNS)
def test_the_systematic_shift_is_that_of_an_image_of_another_scale(signs):
    design, larger = with_views(prototype(), signs), 1.0 + 1e-6
    _, _, cloud = cloud_of(1500.0, [(300, 90)], design=design)
    centre = np.array(design.camera.principal_point_px)
    slopes = {}
    for name, image in view_images(design).items():
        u, v = centre + larger * (np.array(image.project(cloud.positions_mm[0])) - centre)
        slopes[name] = image.direction_of(u, v)[0]
    distance, _ = triangulate(PerView(**slopes), design.views.lower.viewpoint_mm, design.baseline_mm)
    shift = (distance / np.hypot(*cloud.positions_mm[0, :2]) - 1.0) / 1e-6
    assert depth_shifts_per_scale(design, cloud) == pytest.approx([shift], rel=1e-4)


@pytest.mark.parametrize("signs", SIGNS)
def test_the_uncertainty_is_that_of_noisy_projections(signs):
    design = with_views(prototype(), signs)
    _, _, cloud = cloud_of(1500.0, [(300, 90)], noise_px=0.05, design=design)
    rng = np.random.default_rng(2)
    draws = 40000
    seen = {}
    for name, image in view_images(design).items():
        u, v = image.project(cloud.positions_mm[0])
        seen[name] = image.direction_of(u + rng.normal(0, 0.05, draws), v + rng.normal(0, 0.05, draws))
    distance, height = triangulate(
        PerView(lower=seen["lower"][0], upper=seen["upper"][0]), design.views.lower.viewpoint_mm, design.baseline_mm
    )
    assert np.std(distance) == pytest.approx(cloud.sigma_distance_mm[0], rel=0.02)
    assert np.std(height) == pytest.approx(cloud.sigma_height_mm[0], rel=0.02)
    # The azimuth that counts is the mean of both, weighted by their squared radii.
    radii = {name: float(image.radius_px(np.median(seen[name][0]))) for name, image in view_images(design).items()}
    total = sum(radius**2 for radius in radii.values())
    azimuth = sum(radii[name] ** 2 / total * seen[name][1] for name in seen)
    assert 1500.0 * np.std(azimuth) == pytest.approx(cloud.sigma_across_mm[0], rel=0.02)


def test_ply_holds_every_point(tmp_path):
    _, _, cloud = cloud_of(2000.0, [(0, 60), (450, 70), (1799, 80)])
    write_ply(tmp_path / "points.ply", cloud)
    header, body = (tmp_path / "points.ply").read_bytes().split(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    assert "element vertex 3" in lines
    types = {"float": "<f4", "uchar": "u1"}
    fields = [(words[2], types[words[1]]) for words in (line.split() for line in lines) if words[0] == "property"]
    vertex = np.frombuffer(body, dtype=fields)
    np.testing.assert_allclose(np.column_stack([vertex[axis] for axis in "xyz"]), cloud.positions_mm, rtol=1e-6)
    np.testing.assert_array_equal(vertex["red"], cloud.colours[:, 0])
    np.testing.assert_allclose(vertex["sigma_distance_mm"], cloud.sigma_distance_mm, rtol=1e-6)


def cloud_at(positions, colours=None):
    count = len(positions)
    colours = np.full((count, 3), 200, np.uint8) if colours is None else np.array(colours, np.uint8)
    ones, indices = np.ones(count), np.zeros(count, np.intp)
    return PointCloud(np.array(positions, float), colours, ones, ones, ones, indices, indices)


def test_floor_plan_shows_the_slab_from_above():
    plan = floor_plan(cloud_at([(950, 50, 0), (-150, -950, 10), (0, 0, 500)]), (-100, 100), 1000.0, cells=20)
    assert plan.counts.sum() == 2
    assert plan.counts[9, 19] == 1  # x to the right, y upwards
    assert plan.counts[19, 8] == 1
    picture = plan.picture()
    assert picture.shape == (20, 20)
    assert picture[9, 19] == 0
    assert picture[0, 0] == 255


def test_a_view_of_the_cloud_is_a_perspective_with_near_before_far():
    red, green, blue = (255, 0, 0), (0, 255, 0), (0, 0, 255)
    points = [(0, 1000, 0), (0, 2000, 0), (-500, 1000, 0), (0, 1000, 500), (0, -1000, 0)]
    cloud = cloud_at(points, [red, green, blue, green, blue])
    picture = view_of_cloud(cloud, (0, 0, 0), 90.0, 0.0, field_deg=90.0, size_px=(201, 151), point_px=1)
    assert tuple(picture[75, 100]) == red
    assert tuple(picture[75, 50]) == blue  # looking along +y, -x is to the left
    assert tuple(picture[25, 100]) == green  # and +z is up
    assert (picture.any(axis=-1)).sum() == 3
    assert not view_of_cloud(cloud_at([(0, -5, 0)]), (0, 0, 0), 90.0, 0.0).any()
