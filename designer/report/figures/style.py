"""How the figures look: sizes in millimetres, one colour-blind safe palette, and SVG bytes that never change."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib import patheffects
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

MM_PER_INCH = 25.4

# Okabe and Ito's palette; line styles and markers always say the same thing once more, for print in grey.
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
INK, GREY, LIGHT_GREY = "#1a1a1a", "#6b6b6b", "#c9c9c9"
HALO: list[patheffects.AbstractPathEffect] = [patheffects.withStroke(linewidth=2.0, foreground="white")]
"""A white rim that keeps small text legible over lines."""

VIEW_COLOUR = {"upper": BLUE, "lower": VERMILLION}
VIEW_LINE: dict[str, Any] = {"upper": "-", "lower": "--"}
SERIES = ((BLUE, "-", "o"), (VERMILLION, "--", "s"), (GREEN, "-.", "^"), (PURPLE, ":", "D"), (ORANGE, "-", "v"))

_SETTINGS: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.linewidth": 0.35,
    "grid.color": LIGHT_GREY,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "hatch.linewidth": 0.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "designer",
}


@contextmanager
def report_style() -> Iterator[None]:
    """Matplotlib settings of the report, for the length of a with block."""
    with mpl.rc_context(_SETTINGS):
        yield


def new_figure(width_mm: float, height_mm: float, *, constrained: bool = True) -> Figure:
    """An empty figure of a given size on paper."""
    size = (width_mm / MM_PER_INCH, height_mm / MM_PER_INCH)
    figure = Figure(figsize=size, layout="constrained" if constrained else None)
    FigureCanvasSVG(figure)
    return figure


def length_unit(longest_mm: float) -> tuple[float, str]:
    """Millimetres per unit, and the unit, in which lengths up to ``longest_mm`` read best."""
    return (1000.0, "m") if longest_mm >= 1000.0 else (1.0, "mm")


def svg_bytes(figure: Figure) -> bytes:
    """The figure as SVG, without date or other noise: equal figures give equal bytes."""
    # The first layout makes room for the ticks of an axis of another length; the second knows those that are drawn.
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()
