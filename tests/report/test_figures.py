"""Figures keep their text on the paper and their labels apart, and draw to the scale that they name."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from sample_study import crowd, prototype, two_direct_mirrors, write_sample_study

from designer.design import Design
from designer.report.figures.blur import draw_blur
from designer.report.figures.cross_section import draw_cross_section
from designer.report.figures.depth_error import draw_depth_error
from designer.report.figures.depth_map import IMAGE_CIRCLE_PX, coarsened, draw_depth_map
from designer.report.figures.image_layout import draw_image_layout
from designer.report.figures.modulation import draw_modulation
from designer.report.figures.registry import DESIGN_FIGURES, LENS_PANEL, LENS_WIDE, PAGE_PANEL, PANEL_MM
from designer.report.figures.resolution import draw_resolution
from designer.report.figures.style import MM_PER_INCH, report_style, svg_bytes
from designer.report.figures.through_focus import draw_depth_of_field, draw_through_focus
from designer.report.figures.trade import compress_ranks, draw_pareto_fronts, draw_trade
from designer.report.figures.zone_edges import draw_zone_edges
from designer.study.folder import read_study

DESIGNS = {
    "folded": prototype(),
    "folded, upper view inside": prototype(topology="upper_inner"),
    "folded, image beyond the axis": prototype(direct_kind="ellipsoid"),
    "direct": two_direct_mirrors(),
}


def assert_inside_canvas(figure: Figure) -> None:
    """Nothing drawn, text least of all, reaches over the edge of the paper."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = figure.get_tightbbox(canvas.get_renderer())
    width, height = figure.get_size_inches()
    slack = 0.2 / MM_PER_INCH
    assert drawn.x0 >= -slack
    assert drawn.y0 >= -slack
    assert drawn.x1 <= width + slack
    assert drawn.y1 <= height + slack


@pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS.keys())
@pytest.mark.parametrize(
    "draw",
    [
        lambda design: draw_cross_section(design, 170.0, 112.0).figure,
        lambda design: draw_cross_section(design, 97.0, 80.0).figure,
        lambda design: draw_image_layout(design, 82.0, 54.0),
        lambda design: draw_resolution(design, 82.0, 54.0),
        lambda design: draw_depth_map(design, 82.0, 54.0),
        lambda design: draw_depth_error(design, 82.0, 54.0),
        lambda design: draw_blur(design, 170.0, 52.0),
        lambda design: draw_through_focus(design, 82.0, 52.0),
        lambda design: draw_depth_of_field(design, 82.0, 52.0),
        lambda design: draw_modulation(design, 82.0, 52.0),
        lambda design: draw_zone_edges(design, 82.0, 52.0),
    ],
    ids=[
        "large cross-section",
        "cross-section",
        "image layout",
        "resolution",
        "depth map",
        "depth error",
        "blur",
        "through focus",
        "depth of field",
        "modulation",
        "zone edges",
    ],
)
def test_nothing_is_cut_at_the_edge(design: Design, draw: Callable[[Design], Figure]) -> None:
    with report_style():
        assert_inside_canvas(draw(design))


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Bbox]]:
    """Every text of the last drawing of a figure, with the place where it was put, in points from the lower left."""
    texts: list[tuple[str, Bbox]] = []
    draw_figure, draw_text = Figure.draw, Text.draw

    def figure_drawn(self: Figure, renderer: RendererBase) -> None:
        texts.clear()
        draw_figure(self, renderer)

    def text_drawn(self: Text, renderer: RendererBase, *arguments: Any, **options: Any) -> None:
        if self.get_visible() and self.get_text():
            texts.append((self.get_text(), self.get_window_extent(renderer)))
        draw_text(self, renderer, *arguments, **options)

    monkeypatch.setattr(Figure, "draw", figure_drawn)
    monkeypatch.setattr(Text, "draw", text_drawn)
    return texts


def assert_written_inside(figure: Figure, written: list[tuple[str, Bbox]]) -> None:
    svg_bytes(figure)
    width, height = figure.get_size_inches() * MM_PER_INCH
    assert_inside(written, (width, height))


def assert_inside(written: list[tuple[str, Bbox]], size_mm: tuple[float, float]) -> None:
    width, height = (side / MM_PER_INCH * 72.0 for side in size_mm)
    outside = [
        text for text, box in written if min(box.x0, box.y0) < -0.5 or box.x1 > width + 0.5 or box.y1 > height + 0.5
    ]
    assert written
    assert not outside


@pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS.keys())
def test_every_text_of_a_written_figure_lies_inside_it(design: Design, written: list[tuple[str, Bbox]]) -> None:
    with report_style():
        for figure in DESIGN_FIGURES:
            if figure.place in (PAGE_PANEL, LENS_WIDE, LENS_PANEL):
                figure.drawn(design)
                assert_inside(written, figure.size_mm)
        for size in ((170.0, 102.0), (97.0, 80.0), (97.0, 59.0)):
            assert_written_inside(draw_cross_section(design, *size).figure, written)


def test_ticks_that_come_with_the_layout_find_room(written: list[tuple[str, Bbox]]) -> None:
    """With the legend above them, axes up to 12 get a tick 2.5, wider than those that the first layout saw."""
    with report_style():
        figure = draw_resolution(two_direct_mirrors(), *PANEL_MM)
        figure.axes[0].set_ylim(0.0, 12.0)
        assert_written_inside(figure, written)
        assert "2.5" in {text for text, _ in written}


def test_a_cross_section_is_drawn_to_the_scale_it_names() -> None:
    design = two_direct_mirrors()
    with report_style():
        drawing = draw_cross_section(design, 97.0, 80.0)
    axes = drawing.figure.axes[0]
    FigureCanvasAgg(drawing.figure).draw()
    mirrors = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    reach = max(np.abs(patch.get_xy()[:, 0]).max() for patch in mirrors)
    assert reach == pytest.approx(max(mirror.outer_radius_mm for mirror in design.mirrors))
    pixels = axes.transData.transform([(0.0, 0.0), (reach, 0.0), (0.0, reach)])
    on_paper = (pixels - pixels[0]) / drawing.figure.dpi * MM_PER_INCH
    assert on_paper[1] == pytest.approx([reach / drawing.scale, 0.0])
    assert on_paper[2] == pytest.approx([0.0, reach / drawing.scale])


@pytest.mark.parametrize("swept", ["height_mm", "diameter_mm"])
def test_near_ties_are_labelled_apart_and_every_rank_once(tmp_path: Path, swept: str) -> None:
    study = read_study(write_sample_study(tmp_path / "crowd", designs=crowd()))
    with report_style():
        plot = draw_trade(study.feasible, swept, 140.0, 165.0, 92.0)
    assert_inside_canvas(plot.figure)
    canvas = FigureCanvasAgg(plot.figure)
    canvas.draw()
    labels = [text for text in plot.figure.axes[0].texts if text.get_text()]
    boxes = [label.get_window_extent(canvas.get_renderer()) for label in labels]
    assert not [pair for pair in combinations(boxes, 2) if pair[0].overlaps(pair[1])]
    told = [plot.key.get(label.get_text(), label.get_text()) for label in labels]
    ranks = sorted(rank for text in told for rank in _expanded(text))
    assert ranks == list(range(1, len(study.feasible) + 1))


def test_fronts_stay_on_the_paper(tmp_path: Path) -> None:
    study = read_study(write_sample_study(tmp_path / "fronts", designs=crowd(8)))
    ranks = {row.configuration: row.rank or 0 for row in study.feasible}
    with report_style():
        assert_inside_canvas(draw_pareto_fronts(study.pareto, ranks, "height_mm", 140.0, 165.0, 84.0))


def test_ranks_are_written_short() -> None:
    assert compress_ranks([7, 1, 3, 2, 10, 9]) == "1–3, 7, 9, 10"


def test_a_coarse_sensor_sees_the_same_angles() -> None:
    design = prototype()
    coarse = coarsened(design)
    assert coarse.camera.image_radius_mm == pytest.approx(design.camera.image_radius_mm)
    assert 2 * coarse.camera.image_radius_mm / coarse.camera.pixel_pitch_mm == pytest.approx(IMAGE_CIRCLE_PX)


def _expanded(text: str) -> list[int]:
    ranks: list[int] = []
    for part in text.split(", "):
        first, _, last = part.partition("–")
        ranks.extend(range(int(first), int(last or first) + 1))
    return ranks
