"""The report's figures: one entry each, with its file's name, its place, its size on paper, and what draws it.

The pages are laid out from these entries: a new entry appears where its place says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Generic, TypeVar

from matplotlib.figure import Figure

from designer.design import Design
from designer.evaluate.focus import focus_score
from designer.evaluate.score import recorded_fabrication_notes
from designer.report.figures.blur import draw_blur
from designer.report.figures.check import draw_check_errors, draw_check_maps, draw_floor_plan, plan_title, raw_svg
from designer.report.figures.comparators import draw_comparators
from designer.report.figures.cross_section import draw_cross_section
from designer.report.figures.depth_error import draw_depth_error
from designer.report.figures.depth_map import draw_depth_map
from designer.report.figures.image_layout import draw_image_layout
from designer.report.figures.modulation import draw_modulation
from designer.report.figures.resolution import draw_resolution
from designer.report.figures.style import svg_bytes
from designer.report.figures.through_focus import draw_depth_of_field, draw_through_focus
from designer.report.figures.trade import draw_pareto_fronts, draw_trade
from designer.report.figures.yield_curves import SPAN as YIELD_SPAN
from designer.report.figures.yield_curves import draw_yield_curves
from designer.report.figures.zone_edges import draw_zone_edges
from designer.study.checked import CheckedDesign
from designer.study.study import Study

Subject = TypeVar("Subject")

PANEL_MM = (82.0, 52.0)
"""Width and height of a panel on a design's page."""
WINNER_DRAWING, WINNER_PANEL = "winner's drawing", "winner's panel"
PAGE_DRAWING, PAGE_PANEL = "drawing on a design's page", "panel on a design's page"
CHECK_TOP, CHECK_WIDE, CHECK_BOTTOM = "first row of a check", "across a check's page", "last row of a check"
LENS_WIDE, LENS_PANEL = "across a design's second page", "panel on a design's second page"
TRADE = "trade-offs"
COMPARED = "what else could be built"
AS_BUILT = "sensors as built"
TRADE_HEIGHT_MM = 57.0
"""Height of a plot across a page, three of which fill it."""
_PAGE_DRAWING_MM = (97.0, 80.0)
_ROOM_OF_A_NOTE_MM, _MOST_NOTES = 7.0, 3


@dataclass(frozen=True, slots=True)
class DrawnFigure:
    """A finished figure: SVG bytes, how many times smaller than life it is, and the ranks behind a plot's letters."""

    svg: bytes
    scale: float | None = None
    letters: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ReportFigure(Generic[Subject]):
    """A figure of the report, drawn once for each subject: a design, a checked design, or the study.

    ``draw`` takes the subject, width and height in millimetres, and gives None where there is nothing to draw.
    ``title`` stands above a panel, and below a figure on its own; it is Typst markup. ``set_to_mm`` is the width at
    which a picture is printed that is not drawn to a size, such as a photograph.
    """

    name: str
    place: str
    size_mm: tuple[float, float]
    draw: Callable[[Subject, float, float], DrawnFigure | None]
    title: Callable[[Subject], str]
    set_to_mm: float | None = None

    def file(self, subject: str = "") -> str:
        """Name of the figure's file for the subject of that name."""
        return f"{self.name}-{subject}.svg" if subject else f"{self.name}.svg"

    def drawn(self, subject: Subject) -> DrawnFigure | None:
        """The figure of a subject."""
        return self.draw(subject, *self.size_mm)


def _plain(draw: Callable[[Subject, float, float], Figure]) -> Callable[[Subject, float, float], DrawnFigure]:
    return lambda subject, width_mm, height_mm: DrawnFigure(svg_bytes(draw(subject, width_mm, height_mm)))


def _cross_section(design: Design, width_mm: float, height_mm: float) -> DrawnFigure:
    drawing = draw_cross_section(design, width_mm, height_mm)
    return DrawnFigure(svg_bytes(drawing.figure), drawing.scale)


def _cross_section_of_page(design: Design, width_mm: float, height_mm: float) -> DrawnFigure:
    """Fabrication notes stand below the drawing; both must leave room for the panels."""
    notes = min(len(recorded_fabrication_notes(design)), _MOST_NOTES)
    return _cross_section(design, width_mm, height_mm - _ROOM_OF_A_NOTE_MM * notes)


def _trade(column: str) -> Callable[[Study, float, float], DrawnFigure | None]:
    def draw(study: Study, width_mm: float, height_mm: float) -> DrawnFigure | None:
        if sum(row.number(column) is not None for row in study.feasible) < 2:
            return None
        plot = draw_trade(study.feasible, column, _allowed(study, column), width_mm, height_mm)
        return DrawnFigure(svg_bytes(plot.figure), letters=plot.key)

    return draw


def _pareto(column: str) -> Callable[[Study, float, float], DrawnFigure | None]:
    def draw(study: Study, width_mm: float, height_mm: float) -> DrawnFigure | None:
        if not study.feasible or not _has_pareto(study, column):
            return None
        ranks = {row.configuration: row.rank or 0 for row in study.feasible}
        return DrawnFigure(
            svg_bytes(draw_pareto_fronts(study.pareto, ranks, column, _allowed(study, column), width_mm, height_mm))
        )

    return draw


def _comparators(study: Study, width_mm: float, height_mm: float) -> DrawnFigure | None:
    if not any(row.has_numbers for row in study.comparators):
        return None
    envelope = {column: _allowed(study, column) or 0.0 for column in ("height_mm", "diameter_mm")}
    return DrawnFigure(svg_bytes(draw_comparators(study.feasible, study.comparators, envelope, width_mm, height_mm)))


def _yield_curves(study: Study, width_mm: float, height_mm: float) -> DrawnFigure | None:
    found = study.tolerances
    if found is None or all(each.median is None for each in found.designs):
        return None
    ranks = {row.configuration: row.rank or 0 for row in study.feasible}
    return DrawnFigure(svg_bytes(draw_yield_curves(found.designs, ranks, width_mm, height_mm)))


def _allowed(study: Study, column: str) -> float | None:
    """The envelope's bound on a size."""
    envelope = study.requirement.envelope
    return {"height_mm": envelope.height_mm, "diameter_mm": envelope.diameter_mm}.get(column)


def _of_lens(draw: Callable[[Design, float, float], Figure]) -> Callable[[Design, float, float], DrawnFigure | None]:
    """Nothing for a design whose focus no closed form tells."""

    def drawn(design: Design, width_mm: float, height_mm: float) -> DrawnFigure | None:
        return None if focus_score(design) is None else DrawnFigure(svg_bytes(draw(design, width_mm, height_mm)))

    return drawn


def _has_pareto(study: Study, column: str) -> bool:
    return any(point.swept == column and point.depth_error_rms is not None for point in study.pareto)


def _pareto_caption(column: str) -> Callable[[Study], str]:
    """The first Pareto plot says how to read both."""

    def caption(study: Study) -> str:
        reading = "with all other requirements unchanged."
        if column == "height_mm" or not _has_pareto(study, "height_mm"):
            reading += " Each line ends at the smallest design found. Errors above twice the minimum are not shown."
        word = column.removesuffix("_mm")
        return f"Lowest depth error of the best designs as the allowed {word} shrinks, {reading}"

    return caption


def _always(title: str) -> Callable[[object], str]:
    return lambda subject: title


DESIGN_FIGURES: tuple[ReportFigure[Design], ...] = (
    ReportFigure("cross-section-winner", WINNER_DRAWING, (170.0, 102.0), _cross_section, _always("")),
    ReportFigure("image-layout-winner", WINNER_PANEL, (96.0, 68.0), _plain(draw_image_layout), _always("Image layout")),
    ReportFigure("cross-section", PAGE_DRAWING, _PAGE_DRAWING_MM, _cross_section_of_page, _always("")),
    ReportFigure("image-layout", PAGE_PANEL, PANEL_MM, _plain(draw_image_layout), _always("Image layout")),
    ReportFigure("resolution", PAGE_PANEL, PANEL_MM, _plain(draw_resolution), _always("Angular resolution")),
    ReportFigure("depth-resolution", PAGE_PANEL, PANEL_MM, _plain(draw_depth_map), _always("Depth resolution")),
    ReportFigure(
        "depth-error", PAGE_PANEL, PANEL_MM, _plain(draw_depth_error), _always("Depth error against distance")
    ),
    ReportFigure("blur", LENS_WIDE, (170.0, 52.0), _of_lens(draw_blur), _always("Blur against elevation")),
    ReportFigure("through-focus", LENS_PANEL, PANEL_MM, _of_lens(draw_through_focus), _always("Through focus")),
    ReportFigure("depth-of-field", LENS_PANEL, PANEL_MM, _of_lens(draw_depth_of_field), _always("Depth of field")),
    ReportFigure(
        "modulation", LENS_PANEL, PANEL_MM, _of_lens(draw_modulation), _always("Modulation at the matcher's scale")
    ),
    ReportFigure(
        "zone-edges", LENS_PANEL, PANEL_MM, _plain(draw_zone_edges), _always("Light at the border of the zones")
    ),
)
"""Figures of one design: the winner's, and those on both pages of each of the best designs."""

CHECK_FIGURES: tuple[ReportFigure[CheckedDesign], ...] = (
    ReportFigure(
        "check-raw",
        CHECK_TOP,
        (50.0, 50.0),
        lambda checked, width_mm, height_mm: DrawnFigure(raw_svg(checked)),
        _always("Raw image"),
        set_to_mm=50.0,
    ),
    ReportFigure("check-plan", CHECK_TOP, (84.0, 40.0), _plain(draw_floor_plan), plan_title),
    ReportFigure(
        "check-maps",
        CHECK_WIDE,
        (170.0, 0.0),
        lambda checked, width_mm, height_mm: DrawnFigure(svg_bytes(draw_check_maps(checked, width_mm))),
        _always(""),
    ),
    ReportFigure(
        "check-errors",
        CHECK_BOTTOM,
        (92.0, 42.0),
        _plain(draw_check_errors),
        _always("Measured against predicted error"),
    ),
)
"""Figures of an end-to-end check."""

STUDY_FIGURES: tuple[ReportFigure[Study], ...] = (
    ReportFigure(
        "trade-height",
        TRADE,
        (165.0, TRADE_HEIGHT_MM),
        _trade("height_mm"),
        _always("Depth error against height, each feasible design by its rank (@ranking)."),
    ),
    ReportFigure(
        "trade-diameter",
        TRADE,
        (165.0, TRADE_HEIGHT_MM),
        _trade("diameter_mm"),
        _always("Depth error against diameter, each feasible design by its rank (@ranking)."),
    ),
    ReportFigure(
        "trade-blur",
        TRADE,
        (165.0, TRADE_HEIGHT_MM),
        _trade("largest_blur_px"),
        _always("Depth error against the largest blur in the working volume, each feasible design by its rank."),
    ),
    ReportFigure("fronts-height", TRADE, (165.0, TRADE_HEIGHT_MM), _pareto("height_mm"), _pareto_caption("height_mm")),
    ReportFigure(
        "fronts-diameter", TRADE, (165.0, TRADE_HEIGHT_MM), _pareto("diameter_mm"), _pareto_caption("diameter_mm")
    ),
    ReportFigure(
        "trade-comparators",
        COMPARED,
        (165.0, 70.0),
        _comparators,
        _always(
            "Depth error against height and diameter: the feasible designs of the 44, and what else could be built. An "
            "idea whose mark is white inside does not fit into the envelope."
        ),
    ),
    ReportFigure(
        "yield-curves",
        AS_BUILT,
        (165.0, TRADE_HEIGHT_MM),
        _yield_curves,
        _always(
            "Share of the sensors with at most this depth error, for the best designs by rank; dots: as designed. "
            f"Designs with more than {YIELD_SPAN:g} times the least median are left out."
        ),
    ),
)
"""Figures of the study as a whole."""


def design_figures(*places: str) -> list[ReportFigure[Design]]:
    """The figures of one design at some places, in order."""
    return [figure for figure in DESIGN_FIGURES if figure.place in places]


def check_figures(place: str) -> list[ReportFigure[CheckedDesign]]:
    """The figures of a check at a place, in order."""
    return [figure for figure in CHECK_FIGURES if figure.place == place]


def study_figures(place: str) -> list[ReportFigure[Study]]:
    """The figures of the study at a place, in order."""
    return [figure for figure in STUDY_FIGURES if figure.place == place]


def drawings_of(study: Study) -> list[tuple[str, Callable[[], DrawnFigure | None]]]:
    """Every figure of a study's report: the name of its file, and what draws it, or None if there is nothing."""
    found: list[tuple[str, Callable[[], DrawnFigure | None]]] = []
    for place, (_, design) in enumerate(study.best()):
        of_winner = (WINNER_DRAWING, WINNER_PANEL) if place == 0 else ()
        for of_design in design_figures(*of_winner, PAGE_DRAWING, PAGE_PANEL, LENS_WIDE, LENS_PANEL):
            found.append((of_design.file(design.configuration), partial(of_design.drawn, design)))
    found += [(of_study.file(), partial(of_study.drawn, study)) for of_study in STUDY_FIGURES]
    for row, checked in study.checks():
        found += [(of_check.file(row.configuration), partial(of_check.drawn, checked)) for of_check in CHECK_FIGURES]
    return found
