"""The report's section on what else could be built for the requirement."""

from __future__ import annotations

from collections.abc import Mapping

from designer.comparators.row import ComparatorRow
from designer.report.content.tables import in_percent, percent_decimals
from designer.report.figures.registry import COMPARED, DrawnFigure, study_figures
from designer.study.study import Study
from designer.typesetting.markup import DASH, call, cells, literal, number, text, typographic


def comparators(study: Study, drawings: Mapping[str, DrawnFigure]) -> str:
    """Other ideas beside the winner: plot, table, and what to know of them; nothing if they were not asked for."""
    if not study.comparators:
        return ""
    figures = [
        f"#figure(image({literal('figures/' + figure.file())}), caption: [{figure.title(study)}])"
        for figure in study_figures(COMPARED)
        if figure.file() in drawings
    ]
    reasons = [text(f"{_capital(row.title)}: {typographic(row.reason)}.") for row in study.comparators if row.reason]
    return "\n\n".join(
        [
            "== What else could be built <comparators>",
            text(_introduction()),
            *figures,
            _table(study),
            *reasons,
            text(_reading()),
        ]
    )


def _introduction() -> str:
    return (
        "Other ideas for the same camera, envelope and working volume, each with the best design that a search of its "
        "own has found, traced by the same tracer and scored alike: the depth error from two traced rays of each scene "
        "point, with the same noise and scale. An idea that the envelope does not let have the baseline that is asked "
        "for has a smaller one."
    )


def _reading() -> str:
    return (
        "Caustic: the diameter of the smallest ball that all rays of a view meet, the single-viewpoint error. Two "
        "cameras cost twice, and the scale of each is known on its own, so that its errors do not cancel between the "
        "views. Two plane mirrors see one side only, through a lens chosen for them. comparators.csv has the "
        "prescriptions."
    )


def _table(study: Study) -> str:
    errors = [row.depth_error_rms for row in study.comparators if row.depth_error_rms]
    decimals = percent_decimals([*errors, *(row.number("depth_error_rms") for row in study.feasible[:1])])
    rows = [_winner(study, decimals)] if study.feasible else []
    rows += [_row(row, decimals) for row in study.comparators]
    table = call(
        "ruled",
        columns="(1fr,) + (auto,) * 8",
        align="(left,) + (right,) * 8",
        header="([idea], [cameras], [azimuth\\ (°)], [$sigma_D\\/D$\\ (%)], [$b$\\ (mm)], [$H$\\ (mm)], [$W$\\ (mm)], "
        "[largest\\ blur (px)], [caustic\\ (mm)],)",
        rows=cells(rows),
    ).strip()
    caption = "What else could be built, beside the winner; a star marks what does not fit into the envelope."
    return f"#figure({table.removeprefix('#')}, kind: table, caption: [{caption}])"


def _winner(study: Study, decimals: int) -> list[str]:
    row = study.feasible[0]
    columns = ("baseline_mm", "height_mm", "diameter_mm", "largest_blur_px")
    sizes = [number(row.number(column), 1) for column in columns]
    return [
        f"{row.configuration} (winner)",
        "1",
        "360",
        in_percent(row.number("depth_error_rms"), decimals),
        *sizes,
        "0.0",
    ]


def _row(row: ComparatorRow, decimals: int) -> list[str]:
    if not row.has_numbers:
        return [row.title, str(row.cameras), *[DASH] * 7]
    sizes = (row.baseline_mm, row.height_mm, row.diameter_mm, row.largest_blur_px, row.single_viewpoint_error_mm)
    return [
        row.title + (" *" if row.status == "too_large" else ""),
        str(row.cameras),
        number(row.azimuth_deg, 0),
        in_percent(row.depth_error_rms, decimals),
        *(number(size, 1) for size in sizes),
    ]


def _capital(words: str) -> str:
    return words[0].upper() + words[1:]
