"""The principles of the paper's figures 1 and 3: one viewpoint from one mirror, or from two."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from designer.report.figures.schematic import (
    Principle,
    conic_between,
    draw_principle,
    hyperboloid_or_ellipsoid,
    paraboloid_pair,
)
from designer.report.figures.style import new_figure


def draw_single_mirror_principles(width_mm: float, height_mm: float) -> Figure:
    """Draw a hyperboloid, an ellipsoid and a pair of paraboloids, each with one viewpoint (figure 1)."""
    principles = [
        hyperboloid_or_ellipsoid("(a) hyperboloid", 50, 0.6, (8, 14, 20, 26)),
        hyperboloid_or_ellipsoid("(b) ellipsoid", 30, 1.6, (8, 12, 16, 19)),
        paraboloid_pair("(c) pair of paraboloids", 20, 6, 90, (4, 6, 8, 11)),
    ]
    return _draw_principles(principles, width_mm, height_mm, reach=70.0)


def draw_folded_principle(width_mm: float, height_mm: float) -> Figure:
    """Draw two conics that share a focus, the second of which folds the light back (figure 3)."""
    secondary, primary = conic_between(0, 150, 0.2, 1), conic_between(150, 15, 0.85, -1)
    foci = {"P": 0.0, "F'_1": 150.0, "F_1": 15.0}
    folded = Principle("folded: two conics", (secondary, primary), foci, (3.5, 5, 7, 9))
    return _draw_principles([folded], width_mm, height_mm, reach=50.0)


def _draw_principles(principles: Sequence[Principle], width_mm: float, height_mm: float, reach: float) -> Figure:
    figure = new_figure(width_mm, height_mm)
    for axes, principle in zip(figure.subplots(1, len(principles), squeeze=False)[0], principles, strict=True):
        draw_principle(axes, principle, reach)
    return figure
