"""Panoramas: directions to pixels and back, the tracer's word on them, sampling exact to a fraction of a grey level."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.imaging.stereo.panorama import (
    AZIMUTH_PADDING,
    look_up,
    panorama_grid,
    panorama_of,
    scan_lines,
    view_images,
)
from designer.imaging.stereo.placement import ImagePlacement, centred, view_image
from designer.imaging.stereo.rig import build_rig, panoramas
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.analytic_room import Waves, raw_image
from support.imaging_designs import SENSES, SIGNS, coarse_prototype, prototype, with_views

placements = st.builds(
    ImagePlacement,
    st.tuples(st.floats(700, 900), st.floats(500, 700)),
    st.floats(-4.0, 4.0),
    st.floats(0.8, 1.25),
)


@given(
    placements,
    st.sampled_from(SIGNS),
    st.sampled_from(SENSES),
    st.sampled_from(["upper", "lower"]),
    st.floats(-0.6, 0.6),
    st.floats(-np.pi, np.pi),
)
def test_pixel_and_direction_are_inverse(placement, signs, senses, name, slope, azimuth):
    image = view_image(with_views(prototype(), signs, senses), name, placement)
    back_slope, back_azimuth = image.direction_of(*image.pixel_of(slope, azimuth))
    assert back_slope == pytest.approx(slope, abs=1e-11)
    assert np.cos(back_azimuth - azimuth) == pytest.approx(1.0, abs=1e-12)
    assert -np.pi <= back_azimuth <= np.pi


@pytest.mark.parametrize("name", ["upper", "lower"])
def test_the_tracer_sends_each_pixel_where_the_view_says(name):
    design = prototype()
    image, view = view_image(design, name), getattr(design.views, name)
    rng = np.random.default_rng(1)
    slope = np.tan(np.radians(rng.uniform(*view.elevation_deg, 200)))
    azimuth = rng.uniform(-np.pi, np.pi, 200)
    u, v = image.pixel_of(slope, azimuth)
    # The ray of a pixel at the pinhole, from the image plane at f alone.
    pitch, (u0, v0) = design.camera.pixel_pitch_mm, design.camera.principal_point_px
    rays = np.column_stack([(u - u0) * pitch, (v - v0) * pitch, np.full(200, design.camera.focal_length_mm)])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    names = [mirror.name for mirror in design.mirrors]
    trace = trace_sequential(build_instrument(design), [names.index(mirror) for mirror in view.path], rays)
    out = trace.direction
    expected = np.column_stack([np.cos(azimuth), np.sin(azimuth), slope])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(out, expected, atol=1e-10)
    points = trace.hits[-1] + 700.0 * out
    np.testing.assert_allclose(image.project(points), (u, v), atol=1e-7)


@given(st.floats(-0.4, 1799.4), st.floats(-5, 180), st.sampled_from(["spherical", "cylindrical"]))
def test_columns_and_rows_are_inverse_to_directions(column, row, sampling):
    grid = panorama_grid(prototype(), sampling)
    assert grid.column(grid.azimuth(column)) == pytest.approx(column, abs=1e-9)
    assert grid.column(grid.azimuth(column) + 2 * np.pi) == pytest.approx(column, abs=1e-9)
    for view in ("upper", "lower"):
        assert grid.row(view, grid.slope(view, row)) == pytest.approx(row, abs=1e-9)


def test_the_papers_panorama_has_1800_x_160_pixels_of_a_fifth_of_a_degree():
    grid = panorama_grid(prototype(), elevation_deg=(-16, 16))
    assert (grid.columns, grid.rows) == (1800, 160)
    elevations = np.degrees(np.arctan(grid.slope("lower", np.arange(160))))
    np.testing.assert_allclose(elevations, np.linspace(15.9, -15.9, 160), atol=1e-12)


@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_each_panorama_covers_what_its_view_was_asked_to_see(sampling):
    grid, images = panorama_grid(prototype(), sampling), view_images(prototype())
    for name, image in images.items():
        low, high = image.slopes
        assert grid.slope(name, -0.5) == pytest.approx(high)
        assert grid.slope(name, grid.rows - 0.5) <= low + 1e-12
        imaged = look_up(grid, image, name).imaged
        assert imaged[:, : grid.rows - 2].all()


def test_a_panorama_is_not_mirrored():
    # Looking along +x with z up, +y (azimuth 90 degrees) is to the left.
    grid = panorama_grid(prototype())
    assert grid.column(np.pi / 2) < grid.column(0.0) < grid.column(-np.pi / 2)


@pytest.mark.parametrize("signs", SIGNS)
@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_sampling_finds_the_scene_in_every_direction(signs, sampling):
    design = with_views(coarse_prototype(), signs)
    placement = ImagePlacement((410.3, 290.8), 0.7, 0.97)
    texture = Waves(finest_deg=12.0, coarsest_deg=40.0, count=40)
    raw = raw_image(design, lambda azimuth: np.full(azimuth.shape, 1e9), texture, placement)
    rig = build_rig(design, sampling, columns=900, placement=placement)
    # A wall at infinity: both views see the texture at the same direction.
    for name, panorama in panoramas(rig, raw).items():
        slopes = rig.grid.slope(name, np.arange(rig.grid.rows))[:, None]
        azimuths = rig.grid.azimuth(np.arange(900))[None]
        truth = np.clip(texture(*np.broadcast_arrays(azimuths, slopes)), 0, 255)
        imaged = rig.tables[name].imaged.T.copy()
        imaged[[0, 1, -2, -1]] = False  # beyond the zone the raw image is black
        error = (panorama - truth)[imaged]
        # Two roundings to whole grey levels alone give 0.3 to 0.4.
        assert np.sqrt(np.mean(error**2)) < 0.5
        # A shift of the panorama by (down, across) pixels would show as that much of its gradients.
        gradients = np.column_stack([slope[imaged] for slope in np.gradient(truth)])
        shift = np.linalg.lstsq(gradients, error, rcond=None)[0]
        assert np.abs(shift).max() < 0.01


def test_padding_repeats_the_azimuths_of_the_other_end():
    grid, image = panorama_grid(prototype()), view_image(prototype(), "upper")
    table = look_up(grid, image, "upper")
    for coordinates in (table.u_px, table.v_px):
        np.testing.assert_allclose(
            coordinates[:AZIMUTH_PADDING], coordinates[-2 * AZIMUTH_PADDING : -AZIMUTH_PADDING], atol=1e-3
        )
    raw = np.random.default_rng(0).integers(0, 255, (1200, 1600, 3)).astype(np.uint8)
    lines = scan_lines(raw, table)
    assert lines.shape == (1800 + 2 * AZIMUTH_PADDING, grid.rows, 3)
    np.testing.assert_array_equal(panorama_of(lines)[:, 0], lines[AZIMUTH_PADDING])


def test_samples_beyond_the_sensor_are_marked():
    placement = ImagePlacement((900.0, 599.5))
    rig = build_rig(prototype(), placement=placement)
    upper = rig.tables["upper"]
    inner = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    beyond = (upper.u_px[inner] > 1599) | (upper.u_px[inner] < 0)
    assert not upper.imaged[beyond].any()
    assert centred(prototype().camera).center_px == (799.5, 599.5)
