"""Two finished designs: a published one (Jaramillo 2016, the larger rig), and one whose lower view crosses the axis."""

from __future__ import annotations

import math

import pytest

from designer.design import Design

CAMERA = {
    "focal_length_mm": 12.0,
    "pixel_pitch_mm": 0.0044,
    "width_px": 1600,
    "height_px": 1200,
    "f_number": 8.0,
    "lens_radius_mm": 3.0,
    "lens_front_mm": 2.0,
    "lens_length_mm": 30.0,
    "body_radius_mm": 22.0,
}


def gain_of(conic: float) -> float:
    q = 1 / math.sqrt(-conic)
    return (1 - q) / (1 + q)


@pytest.fixture
def published() -> Design:
    upper_conic, primary_conic = -1.535920, -1.258254
    mirror = {"thickness_mm": 2.0, "outer_radius_mm": 37.0, "inner_radius_mm": 17.226}
    return Design.model_validate(
        {
            "schema": 1,
            "configuration": "folded-HyPl-Hy-upper_outer",
            "camera": CAMERA,
            "mirrors": [
                mirror
                | {
                    "name": "direct",
                    "kind": "hyperboloid",
                    "vertex_mm": 111.5648,
                    "radius_mm": 26.69995,
                    "conic": upper_conic,
                    "faces": "down",
                },
                mirror
                | {
                    "name": "primary",
                    "kind": "hyperboloid",
                    "vertex_mm": 5.0002,
                    "radius_mm": -27.83526,
                    "conic": primary_conic,
                    "inner_radius_mm": 3.392,
                    "faces": "up",
                },
                mirror
                | {
                    "name": "secondary",
                    "kind": "plane",
                    "vertex_mm": 116.842,
                    "radius_mm": None,
                    "conic": 0.0,
                    "inner_radius_mm": 0.0,
                    "outer_radius_mm": 17.226,
                    "faces": "down",
                },
            ],
            "views": {
                "upper": {
                    "path": ["direct"],
                    "viewpoint_mm": 123.488,
                    "gain": gain_of(upper_conic),
                    "sense": "direct",
                    "elevation_deg": [-21.0, 13.9],
                    "zone": "outer",
                },
                "lower": {
                    "path": ["secondary", "primary"],
                    "viewpoint_mm": -8.119,
                    "gain": gain_of(primary_conic),
                    "sense": "folded",
                    "elevation_deg": [-13.9, 20.0],
                    "zone": "inner",
                },
            },
            "baseline_mm": 131.607,
            "height_mm": 118.842,
            "diameter_mm": 74.0,
            "working_volume": {"elevation_deg": [-8.0, 8.0], "distance_mm": [500.0, 2000.0]},
            "noise_px": 0.5,
        }
    )


@pytest.fixture
def crossing(published: Design) -> Design:
    """An ellipsoidal direct mirror above the pinhole gives the upper view with a negative gain."""
    c, q = 61.744, 1.24
    lower_side = published.model_dump(mode="json", by_alias=True)
    lower_side["mirrors"][0] |= {
        "kind": "ellipsoid",
        "vertex_mm": c * (1 + q),
        "radius_mm": c * (1 - q * q) / q,
        "conic": -1 / q**2,
        "inner_radius_mm": 10.0,
        "outer_radius_mm": 25.0,
    }
    lower_side["views"]["upper"]["gain"] = (1 - q) / (1 + q)
    return Design.model_validate(lower_side)
