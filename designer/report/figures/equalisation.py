"""How many pixels reverse verification rejects, by the way in which the panoramas were sampled (figure 10)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from designer.imaging.endtoend.equalisation_experiment import METHODS, Method
from designer.report.figures.style import GREY, HALO, INK, LIGHT_GREY, new_figure

METHOD_NAMES: dict[Method, str] = {
    "bilinear": "bilinear",
    "smoothed_alike": "smoothed alike",
    "equalised": "equalised",
}


def draw_rejections(
    rejected_percent: Mapping[str, Mapping[Method, NDArray[np.float64]]], width_mm: float, height_mm: float
) -> Figure:
    """Draw rejected pixels, one panel for each condition: a line for each seed, a bar for the mean.

    Parameters
    ----------
    rejected_percent
        For each condition, by its title, and each way of sampling: percent of the panorama's pixels, (seeds,).
    """
    figure = new_figure(width_mm, height_mm)
    panels = np.atleast_1d(figure.subplots(1, len(rejected_percent)))
    places = np.arange(len(METHODS))
    for axes, (title, values) in zip(panels, rejected_percent.items(), strict=True):
        table = np.array([values[method] for method in METHODS])
        axes.plot(places, table, color=LIGHT_GREY, linewidth=0.7, zorder=1)
        axes.plot(places, table, ".", color=GREY, markersize=3.0, zorder=2)
        axes.plot(places, table.mean(axis=1), "_", color=INK, markersize=22, markeredgewidth=1.6, zorder=3)
        for place, mean in zip(places, table.mean(axis=1), strict=True):
            label = axes.annotate(f"{mean:.2f}", (place + 0.25, mean), va="center", fontsize=7.5, zorder=4)
            label.set_path_effects(HALO)
        axes.set_title(title)
        axes.set_xticks(places, [METHOD_NAMES[method] for method in METHODS])
        axes.set_xlim(-0.4, len(METHODS) - 0.4)
        axes.margins(y=0.15)
    panels[0].set_ylabel("rejected by reverse verification (%)")
    return figure
