"""From a study's folder to its figures and ``study.pdf``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from designer.files import write_atomically
from designer.report.content.check_section import figure_name
from designer.report.content.legible import legible_source
from designer.report.content.sections import Illustrations
from designer.report.figures.check import draw_check_errors, draw_check_maps, draw_floor_plan, raw_svg
from designer.report.figures.cross_section import draw_cross_section
from designer.report.figures.depth_error import draw_depth_error
from designer.report.figures.depth_map import draw_depth_map
from designer.report.figures.image_layout import draw_image_layout
from designer.report.figures.resolution import draw_resolution
from designer.report.figures.style import report_style, svg_bytes
from designer.report.figures.trade import draw_fronts, draw_trade
from designer.report.typst.pdf import typeset
from designer.study.outputs import FIGURES, PDF, report_figures
from designer.study.results import StudyFolder, read_folder

PANEL_MM = (82.0, 52.0)
"""Width and height of a panel on a design's page."""

PANELS: dict[str, Callable[..., Figure]] = {
    "image-layout": draw_image_layout,
    "resolution": draw_resolution,
    "depth-resolution": draw_depth_map,
    "depth-error": draw_depth_error,
}


def write_pdf(study_dir: Path, tell: Callable[[str], None] | None = None) -> Path:
    """Draw a study's figures, typeset its report, and return the path of ``study.pdf``.

    The same folder gives the same bytes. Every file appears whole or not at all; figures of an earlier report on the
    same folder that no longer apply are removed. ``tell`` is called with a sentence if some words could not be printed.

    Raises
    ------
    InputError
        A file of the study is absent or cannot be understood.
    """
    study = read_folder(study_dir)
    illustrations = draw_figures(study)
    text, note = legible_source(study, illustrations)
    pdf = typeset(text, illustrations.files)
    if note and tell is not None:
        tell(note)
    for name, svg in illustrations.files.items():
        write_atomically(study_dir / FIGURES / name, svg)
    for figure in report_figures(study_dir):
        if figure.name not in illustrations.files:
            figure.unlink()
    path = study_dir / PDF
    write_atomically(path, pdf)
    return path


def draw_figures(study: StudyFolder) -> Illustrations:
    """Every figure of the report."""
    illustrations = Illustrations()
    with report_style():
        for place, (_, design) in enumerate(study.best()):
            if place == 0:
                winner = draw_cross_section(design, 170.0, 102.0)
                name = f"cross-section-winner-{design.configuration}.svg"
                illustrations.files[name] = svg_bytes(winner.figure)
                illustrations.scales[name] = winner.scale
                layout = draw_image_layout(design, 96.0, 68.0)
                illustrations.files[f"image-layout-winner-{design.configuration}.svg"] = svg_bytes(layout)
            # Remarks stand below the drawing; both must leave room for the panels.
            drawing = draw_cross_section(design, 97.0, 80.0 - 7.0 * min(len(design.score.get("remarks") or []), 3))
            name = f"cross-section-{design.configuration}.svg"
            illustrations.files[name] = svg_bytes(drawing.figure)
            illustrations.scales[name] = drawing.scale
            for panel, draw in PANELS.items():
                illustrations.files[f"{panel}-{design.configuration}.svg"] = svg_bytes(draw(design, *PANEL_MM))
        if study.feasible:
            _draw_trades(study, illustrations)
        _draw_checks(study, illustrations)
    return illustrations


def _draw_checks(study: StudyFolder, illustrations: Illustrations) -> None:
    for row, checked in study.checks():
        pictures = {
            "raw": raw_svg(checked),
            "maps": svg_bytes(draw_check_maps(checked, 170.0)),
            "plan": svg_bytes(draw_floor_plan(checked, 84.0, 40.0)),
            "errors": svg_bytes(draw_check_errors(checked, 92.0, 45.0)),
        }
        for kind, content in pictures.items():
            illustrations.files[Path(figure_name(kind, row.configuration)).name] = content


def _draw_trades(study: StudyFolder, illustrations: Illustrations) -> None:
    envelope = study.requirement.get("envelope", {})
    # Below a short ranking both trade plots fit, and the fronts have a page; else one does, and the fronts follow the
    # other on the next page.
    trade_mm, front_mm = 82.0, 84.0 if len(study.feasible) <= 6 else 68.0
    ranks = {row.configuration: row.rank or 0 for row in study.feasible}
    for swept in ("height_mm", "diameter_mm"):
        word = swept.removesuffix("_mm")
        limit = envelope.get(swept)
        if len(study.feasible) > 1:
            plot = draw_trade(study.feasible, swept, limit, 165.0, trade_mm)
            illustrations.files[f"trade-{word}.svg"] = svg_bytes(plot.figure)
            illustrations.keys[f"trade-{word}.svg"] = plot.key
        if any(point.swept == swept and point.depth_error_rms is not None for point in study.fronts):
            fronts = draw_fronts(study.fronts, ranks, swept, limit, 165.0, front_mm)
            illustrations.files[f"fronts-{word}.svg"] = svg_bytes(fronts)
