"""Figures keep their text on the paper and their labels apart, and draw to the scale that they name."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from sample_study import crowd, prototype, two_direct_mirrors, write_sample_study

from designer.design import Design
from designer.report.figures.cross_section import draw_cross_section
from designer.report.figures.depth_error import draw_depth_error
from designer.report.figures.depth_map import IMAGE_CIRCLE_PX, coarsened, draw_depth_map
from designer.report.figures.image_layout import draw_image_layout
from designer.report.figures.resolution import draw_resolution
from designer.report.figures.style import MM_PER_INCH, report_style
from designer.report.figures.trade import compress_ranks, draw_fronts, draw_trade
from designer.report.folder import read_folder

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
    ],
    ids=["large cross-section", "cross-section", "image layout", "resolution", "depth map", "depth error"],
)
def test_nothing_is_cut_at_the_edge(design: Design, draw: Callable[[Design], Figure]) -> None:
    with report_style():
        assert_inside_canvas(draw(design))


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
    study = read_folder(write_sample_study(tmp_path / "crowd", designs=crowd()))
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
    study = read_folder(write_sample_study(tmp_path / "fronts", designs=crowd(8)))
    ranks = {row.configuration: row.rank or 0 for row in study.feasible}
    with report_style():
        assert_inside_canvas(draw_fronts(study.fronts, ranks, "height_mm", 140.0, 165.0, 84.0))


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
