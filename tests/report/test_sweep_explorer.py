"""The interactive front draws what the designs are: every number it shows is held against the design record."""

import json

import numpy as np
import pandas as pd
import pytest

from designer.design import Design
from support import DATA

pytest.importorskip("plotly")

from designer.report.figures.sweep_explorer import cross_section_lines, draw_explorer  # needs plotly

RECORDS = json.loads((DATA / "studied_designs.json").read_text(encoding="utf-8"))
DESIGNS = [Design.model_validate(record) for record in RECORDS]
TRACES = ("front", "chosen", "camera", "substrates", "upper", "lower", "faces", "viewpoints")


def front_of(designs: list[Design]) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "point": range(len(designs)),
            "asked.envelope.height_mm": 140.0,
            "configuration": [design.configuration for design in designs],
            "depth_error_rms": [0.01 * (place + 1) for place in range(len(designs))],
            "limit_ratio": 1.0,
            "baseline_mm": [design.baseline_mm for design in designs],
            "height_mm": [design.height_mm for design in designs],
            "diameter_mm": [design.diameter_mm for design in designs],
        }
    )


def pieces(lines: np.ndarray) -> list[np.ndarray]:
    gaps = np.flatnonzero(np.isnan(lines[:, 0]))
    return [part[~np.isnan(part[:, 0])] for part in np.split(lines, gaps)]


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_faces_lie_on_their_conics_and_rays_leave_from_their_viewpoints(design: Design) -> None:
    lines = cross_section_lines(design)
    faces = pieces(lines["faces"])
    assert len(faces) == 2 * len(design.mirrors)
    for mirror, face in zip(np.repeat(design.mirrors, 2), faces, strict=True):
        radius, height = np.abs(face[:, 0]), face[:, 1] - mirror.vertex_mm
        # The conic through its vertex: R^2 = 2 r z - (1 + K) z^2, which a plane keeps with curvature zero.
        curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
        residual = curvature * radius**2 - 2.0 * height + curvature * (1.0 + mirror.conic) * height**2
        np.testing.assert_allclose(residual, 0.0, atol=1e-9)
        assert (radius.min(), radius.max()) == pytest.approx((mirror.inner_radius_mm, mirror.outer_radius_mm))
    for name, side in (("upper", 1.0), ("lower", -1.0)):
        view = getattr(design.views, name)
        rays = pieces(lines[name])
        assert len(rays) == 5
        for ray in rays:
            (r, z), (r_end, z_end) = ray[-2:]
            assert side * r_end > 0.0
            assert z - r * (z_end - z) / (r_end - r) == pytest.approx(view.viewpoint_mm, abs=1e-6)
        elevations = [np.degrees(np.arctan2(ray[-1, 1] - ray[-2, 1], abs(ray[-1, 0] - ray[-2, 0]))) for ray in rays]
        assert (min(elevations), max(elevations)) == pytest.approx(view.elevation_deg, abs=1e-6)


def test_every_place_of_the_slider_shows_its_own_design() -> None:
    designs = DESIGNS[:4]
    figure = draw_explorer(front_of(designs), designs).to_dict()
    steps = figure["layout"]["sliders"][0]["steps"]
    assert len(steps) == len(designs)
    for place, (design, step) in enumerate(zip(designs, steps, strict=True)):
        data, layout, traces = step["args"]
        shown = dict(zip((TRACES[trace] for trace in traces), zip(data["x"], data["y"], strict=True), strict=True))
        assert shown["chosen"][0] == [design.height_mm]
        assert shown["chosen"][1] == [pytest.approx(place + 1)]
        heights = [height for radius, height in zip(*shown["viewpoints"], strict=True) if height]
        viewpoints = (design.views.upper.viewpoint_mm, design.views.lower.viewpoint_mm)
        assert heights == pytest.approx(viewpoints, abs=1e-3)
        widest = max(abs(radius) for radius in shown["faces"][0] if radius is not None)
        assert widest == pytest.approx(max(mirror.outer_radius_mm for mirror in design.mirrors), abs=1e-3)
        assert design.configuration in layout["title.text"]
    # What is drawn before anybody moves the slider is its first place.
    data, _, traces = steps[0]["args"]
    for trace, x in zip(traces, data["x"], strict=True):
        assert list(figure["data"][trace]["x"]) == x


def test_hover_says_what_each_design_is() -> None:
    designs = DESIGNS[:4]
    dots = draw_explorer(front_of(designs), designs).to_dict()["data"][0]
    for design, text in zip(designs, dots["text"], strict=True):
        assert design.configuration in text
        assert f"height {design.height_mm:.1f} mm" in text
        assert "allowed height (mm): 140" in text
