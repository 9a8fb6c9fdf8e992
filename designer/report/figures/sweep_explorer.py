"""A sweep's Pareto front to explore in a notebook: hover says what a design is, the slider shows its cross-section.

The figure holds every cross-section itself, so that the slider works without a running kernel, in a saved page too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from plotly import graph_objects

from designer.design import Design
from designer.report.figures.style import GREY, INK, LIGHT_GREY, VIEW_COLOUR
from designer.report.figures.sweep import short
from designer.study.sweep.tables import axis_columns
from designer.trace.outline import SIDES, body_box, face_outline, leaving_rays, lens_box, substrate

Lines = NDArray[np.float64]
"""Polylines (n, 2) of signed distance from the axis and height, mm; a row of NaN stands between one and the next."""

RAYS = 5
SAMPLES_OF_A_FACE = 40
MARGIN = 1.15
# One trace each, in the order in which they are drawn; the slider changes what they hold.
_PARTS: dict[str, dict[str, Any]] = {
    "camera": {"mode": "lines", "fill": "toself", "fillcolor": "#eeeeee", "line": {"color": GREY, "width": 1}},
    "substrates": {"mode": "lines", "fill": "toself", "fillcolor": LIGHT_GREY, "line": {"color": GREY, "width": 0.5}},
    "upper": {"mode": "lines", "line": {"color": VIEW_COLOUR["upper"], "width": 1}},
    "lower": {"mode": "lines", "line": {"color": VIEW_COLOUR["lower"], "width": 1, "dash": "dash"}},
    "faces": {"mode": "lines", "line": {"color": INK, "width": 2.5}},
    "viewpoints": {"mode": "markers", "marker": {"color": INK, "size": 7, "symbol": "diamond"}},
}


def draw_explorer(pareto: pd.DataFrame, designs: Sequence[Design]) -> graph_objects.Figure:
    """Depth error against height of some designs on the left, the cross-section of the chosen one on the right.

    Parameters
    ----------
    pareto
        Rows of a sweep's table, at least one, such as :meth:`designer.api.SweepResult.front` gives.
    designs
        The design of each row.
    """
    sections = [cross_section_lines(design) for design in designs]
    left, right = {"xaxis": "x", "yaxis": "y"}, {"xaxis": "x2", "yaxis": "y2"}
    chosen = {"mode": "markers", "marker": {"size": 19, "symbol": "circle-open", "color": INK, "line": {"width": 2}}}
    figure = graph_objects.Figure(
        [
            _dots(pareto) | left,
            {"type": "scatter", "hoverinfo": "skip", **chosen, **_place(pareto, 0), **left},
            *(
                {"type": "scatter", "hoverinfo": "skip", **look, **_plain(sections[0][part]), **right}
                for part, look in _PARTS.items()
            ),
        ]
    )
    figure.update_layout(
        **_frame(sections),
        template="plotly_white",
        showlegend=False,
        height=520,
        margin={"t": 60},
        title={"text": _caption(pareto, 0), "font": {"size": 14}},
        sliders=[{"steps": _steps(pareto, sections), "currentvalue": {"prefix": "design "}, "pad": {"t": 45}}],
    )
    return figure


def cross_section_lines(design: Design) -> dict[str, Lines]:
    """What the meridional section of a design shows: camera, substrates, faces, viewpoints, rays of either view.

    The upper view's rays leave to the right, the lower view's to the left, over the elevations asked of them.
    """
    camera, span = design.camera, 6.0 * max(design.height_mm, design.diameter_mm)
    boxes = (lens_box(camera), body_box(camera, camera.lens_seat_mm - 0.5 * camera.lens_length_mm))
    both_sides = [(mirror, side) for mirror in design.mirrors for side in SIDES]
    return {
        "camera": _joined(box.outline for box in boxes),
        "substrates": _joined(substrate(mirror, SAMPLES_OF_A_FACE, side) for mirror, side in both_sides),
        "upper": _joined(leaving_rays(design, "upper", RAYS, span)),
        "lower": _joined(leaving_rays(design, "lower", RAYS, span)),
        "faces": _joined(face_outline(mirror, SAMPLES_OF_A_FACE, side) for mirror, side in both_sides),
        "viewpoints": np.array([[0.0, 0.0], *([0.0, view.viewpoint_mm] for view in design.views.by_name.values())]),
    }


def _joined(lines: Iterable[Lines]) -> Lines:
    """One array of several polylines."""
    parts = [part for line in lines for part in (line, np.full((1, 2), np.nan))]
    return np.vstack(parts[:-1]) if parts else np.empty((0, 2))


def _plain(lines: Lines) -> dict[str, list[float | None]]:
    """Coordinates to a thousandth of a millimetre, gaps as None: what fits into a page."""
    x, y = ([None if np.isnan(value) else round(float(value), 3) for value in column] for column in lines.T)
    return {"x": x, "y": y}


def _dots(pareto: pd.DataFrame) -> dict[str, Any]:
    """Every design as a dot that says under the pointer what it is."""
    return {
        "type": "scatter",
        "mode": "markers",
        "x": pareto["height_mm"].tolist(),
        "y": (100.0 * pareto["depth_error_rms"]).tolist(),
        "text": [_hover(pareto, place) for place in range(len(pareto))],
        "hoverinfo": "text",
        "marker": {
            "size": 10,
            "color": pareto["diameter_mm"].tolist(),
            "colorscale": "Cividis",
            "colorbar": {"title": {"text": "diameter (mm)"}, "x": 0.4, "thickness": 12},
        },
    }


def _hover(pareto: pd.DataFrame, place: int) -> str:
    row = pareto.iloc[place]
    asked = [f"{short(axis)}: {row[axis]:g}" for axis in axis_columns(pareto)]
    found = [
        f"depth error {100.0 * row['depth_error_rms']:.3g} %, {row['limit_ratio']:.3f} of the limit",
        f"baseline {row['baseline_mm']:.4g} mm, height {row['height_mm']:.1f} mm, diameter {row['diameter_mm']:.1f} mm",
    ]
    return "<br>".join([f"<b>{place + 1}: {row['configuration']}</b>", *asked, *found])


def _caption(pareto: pd.DataFrame, place: int) -> str:
    row = pareto.iloc[place]
    return (
        f"{place + 1}: {row['configuration']}, point {row['point']}<br>"
        f"depth error {100.0 * row['depth_error_rms']:.3g} %, height {row['height_mm']:.1f} mm, "
        f"diameter {row['diameter_mm']:.1f} mm"
    )


def _place(pareto: pd.DataFrame, place: int) -> dict[str, list[float | None]]:
    row = pareto.iloc[place]
    return {"x": [float(row["height_mm"])], "y": [100.0 * float(row["depth_error_rms"])]}


def _steps(pareto: pd.DataFrame, sections: Sequence[dict[str, Lines]]) -> list[dict[str, Any]]:
    """What the slider does at each of its places: move the ring, draw another cross-section, say which."""
    traces = list(range(1, 2 + len(_PARTS)))
    steps = []
    for place, section in enumerate(sections):
        shown = [_place(pareto, place), *(_plain(section[part]) for part in _PARTS)]
        data = {axis: [part[axis] for part in shown] for axis in ("x", "y")}
        layout = {"title.text": _caption(pareto, place)}
        steps.append({"method": "update", "label": str(place + 1), "args": [data, layout, traces]})
    return steps


def _frame(sections: Sequence[dict[str, Lines]]) -> dict[str, Any]:
    """Axes of both panels; all cross-sections to one scale, so that sizes compare at sight."""
    solid = np.vstack([section[part] for section in sections for part in ("substrates", "viewpoints")])
    half_width = MARGIN * float(np.nanmax(np.abs(solid[:, 0])))
    low, high = float(np.nanmin(solid[:, 1])), float(np.nanmax(solid[:, 1]))
    room = (MARGIN - 1.0) * (high - low)
    return {
        "xaxis": {"domain": [0.0, 0.38], "title": {"text": "height (mm)"}},
        "yaxis": {"title": {"text": "depth error (% RMS)"}},
        "xaxis2": {"domain": [0.55, 1.0], "range": [-2.0 * half_width, 2.0 * half_width], "title": {"text": "R (mm)"}},
        "yaxis2": {
            "anchor": "x2",
            "range": [low - room, high + room],
            "scaleanchor": "x2",
            "title": {"text": "z (mm)"},
        },
    }
