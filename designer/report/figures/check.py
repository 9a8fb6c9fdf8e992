"""What an end-to-end check saw and measured: panoramas, disparities, errors, floor plan, error against distance."""

from __future__ import annotations

import base64
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from designer.design import Design
from designer.imaging.endtoend.bands import LARGEST_ERROR_RATIO, LEAST_ERROR_RATIO
from designer.imaging.endtoend.noise import robust_deviation
from designer.imaging.stereo.cloud import heights_at_every_distance
from designer.report.figures.style import BLUE, INK, LIGHT_GREY, VERMILLION, length_unit, new_figure
from designer.study.checked import CheckedDesign
from designer.typesetting.markup import number

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

RAW_WIDTH_PX = 900
"""Width to which raw images are reduced for print."""

STRIP_COLUMNS = 1200
"""Columns to which panoramas are reduced for print."""

ERROR_SIGMAS = 4.0
"""Errors in units of the prediction at which the error map's colours end."""

# Shares of the heights that the volume holds at every distance; the paper's -20 to -10 cm for its prototype.
_SLAB = (0.15, 0.33)
_BINS = 16
_FEWEST_IN_BIN = 200


def raw_svg(checked: CheckedDesign) -> bytes:
    """The raw image reduced for print: a JPEG within an SVG, the only kind of file that the typesetter is given."""
    height, width = checked.raw.shape
    size = (RAW_WIDTH_PX, round(height * RAW_WIDTH_PX / width))
    smaller = cv2.resize(checked.raw, size, interpolation=cv2.INTER_AREA) if width > RAW_WIDTH_PX else checked.raw
    _, encoded = cv2.imencode(".jpg", smaller, [cv2.IMWRITE_JPEG_QUALITY, 85])
    height, width = smaller.shape
    data = base64.b64encode(encoded.tobytes()).decode("ascii")
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
        f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,{data}"/></svg>\n'
    )
    return svg.encode("ascii")


def draw_check_maps(checked: CheckedDesign, width_mm: float) -> Figure:
    """Draw the panoramas, the disparity map and the error map one under another, to one scale in both directions.

    Dropped pixels are black in the disparity map and grey in the error map, where white is what is not judged.
    """
    left, right, gap, bottom, top = 11.0, 17.0, 4.6, 8.5, 4.0
    rows, columns = checked.upper.shape
    across = width_mm - left - right
    tall = across * rows / columns
    figure = new_figure(width_mm, 4 * tall + 3 * gap + bottom + top, constrained=False)
    total = 4 * tall + 3 * gap + bottom + top
    upper, lower = _limits(checked.maps.elevation_upper_deg), _limits(checked.maps.elevation_lower_deg)
    strips = (
        ("upper panorama", _grey(checked.upper), upper, None),
        ("lower panorama", _grey(checked.lower), lower, None),
        ("disparity (rows), black where rejected", *_disparity_picture(checked, upper)),
        (
            "depth error in units of the prediction, grey where rejected, white where not assessed",
            *_error_picture(checked, upper),
        ),
    )
    for index, (title, picture, limits, scale) in enumerate(strips):
        low = total - top - (index + 1) * tall - index * gap
        axes = figure.add_axes((left / width_mm, low / total, across / width_mm, tall / total))
        axes.imshow(picture, extent=(180.0, -180.0, *limits), aspect="auto", interpolation="none")
        axes.set_title(title, loc="left", fontsize=7.5, pad=2.0)
        axes.spines[:].set_visible(True)
        axes.set_xticks(range(-180, 181, 45))
        axes.tick_params(labelsize=7.0, length=2.0)
        if index == len(strips) - 1:
            axes.set_xlabel("azimuth (°)", labelpad=1.5)
        else:
            axes.set_xticklabels([])
        axes.set_ylabel("elev. (°)", fontsize=7.0, labelpad=1.0)
        if scale is not None:
            bar = figure.add_axes(((left + across + 2.5) / width_mm, low / total, 2.5 / width_mm, tall / total))
            figure.colorbar(scale, cax=bar)
            bar.tick_params(labelsize=7.0, length=2.0)
    return figure


def draw_floor_plan(checked: CheckedDesign, width_mm: float, height_mm: float) -> Figure:
    """Draw the points of a slab of heights on the floor (the paper's figure 12), over where they truly stand."""
    design = checked.design
    low, high = slab_of(design)
    far = 1.05 * design.working_volume.distance_mm[1]
    unit_mm, unit = length_unit(far)
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for distance, colour, label in (
        (checked.maps.true_distance_mm, VERMILLION, "true"),
        (checked.maps.distance_mm, INK, "measured"),
    ):
        counts = _plan(checked, distance, (low, high), far)
        picture = np.zeros((*counts.shape, 4))
        picture[..., :3] = np.array([int(colour[start : start + 2], 16) for start in (1, 3, 5)]) / 255.0
        picture[..., 3] = (
            np.minimum(1.0, np.sqrt(counts / max(float(np.percentile(counts[counts > 0], 80)), 1.0)))
            if counts.any()
            else 0.0
        )
        reach = far / unit_mm
        axes.imshow(picture, extent=(-reach, reach, -reach, reach), origin="lower", interpolation="none")
        axes.plot([], [], "s", color=colour, markersize=3.5, mew=0, label=label)
    axes.plot([0], [0], marker="+", color=BLUE, markersize=6)
    axes.set_aspect("equal")
    axes.set_xlabel(f"$X$ ({unit})")
    axes.set_ylabel(f"$Y$ ({unit})")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.0)
    return figure


def slab_of(design: Design) -> tuple[float, float]:
    """Heights z (mm) of the floor plan: a slab below the middle of those that the volume holds at every distance."""
    bottom, top = heights_at_every_distance(design)
    first, last = (bottom + share * (top - bottom) for share in _SLAB)
    return first, last


def plan_title(checked: CheckedDesign) -> str:
    """What the floor plan shows: the slab's heights, measured from the middle of the baseline."""
    low, high = (height - checked.design.views.middle_mm for height in slab_of(checked.design))
    return f"Floor plan, {number(low, 0)} to {number(high, 0)} mm"


def draw_check_errors(checked: CheckedDesign, width_mm: float, height_mm: float) -> Figure:
    """Draw measured against predicted depth error by distance, robust RMS and bias, with the bounds of passing."""
    design, verdict = checked.design, checked.verdict
    near, far = design.working_volume.distance_mm
    unit_mm, unit = length_unit(far)
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    distance, measured, predicted, bias = errors_by_distance(checked)
    x = distance / unit_mm
    axes.fill_between(
        x,
        100 * LEAST_ERROR_RATIO * predicted,
        100 * LARGEST_ERROR_RATIO * predicted,
        color=BLUE,
        alpha=0.15,
        linewidth=0,
        label=f"{LEAST_ERROR_RATIO:g} to {LARGEST_ERROR_RATIO:g} times",
    )
    axes.plot(x, 100 * predicted, color=BLUE, label="predicted $\\sigma_D/D$")
    axes.plot(x, 100 * measured, "o", color=INK, markersize=3.5, label="measured, robust rms")
    axes.plot(x, 100 * np.abs(bias), "x", color=VERMILLION, markersize=4.0, label="bias, absolute")
    # A bound far above everything else would only press the rest flat; the table beside the figure gives it.
    top, shown = 2.2 * 100.0 * float(np.max(np.maximum(measured, predicted), initial=1e-6)), False
    for band in verdict.bands:
        ends = np.array(band.distance_mm) / unit_mm
        axes.axvline(ends[1], color=LIGHT_GREY, linewidth=0.5, zorder=0)
        if band.bias_bound is not None and 100 * band.bias_bound < top:
            label = None if shown else "largest bias allowed"
            axes.plot(ends, [100 * band.bias_bound] * 2, ":", color=VERMILLION, linewidth=0.9, label=label)
            shown = True
    axes.set_xscale("log")
    axes.set_xlim(near / unit_mm, far / unit_mm)
    axes.set_ylim(0, top)
    axes.set_xticks(_nice_ticks(near / unit_mm, far / unit_mm))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(f"distance from the axis $D$ ({unit})")
    axes.set_ylabel("depth error (%)")
    axes.legend(loc="upper left", fontsize=7.0, ncols=2, columnspacing=1.0)
    return figure


def errors_by_distance(checked: CheckedDesign) -> tuple[Floats, Floats, Floats, Floats]:
    """Distances (mm), and there the robust RMS measured, the predicted and the median relative error, all (n,)."""
    near, far = checked.design.working_volume.distance_mm
    distance = checked.maps.true_distance_mm
    error, predicted = checked.relative_error, checked.maps.predicted
    kept = checked.maps.both_see & (checked.maps.outcome == 0) & np.isfinite(error)
    rows = []
    edges = np.geomspace(near, far, _BINS + 1)
    for low, high in pairwise(edges):
        inside = kept & (distance >= low) & (distance < high)
        if inside.sum() >= _FEWEST_IN_BIN:
            spread = robust_deviation(error[inside])
            rows.append((np.sqrt(low * high), spread, np.median(predicted[inside]), np.median(error[inside])))
    table = np.array(rows, dtype=float).reshape(-1, 4)
    return table[:, 0], table[:, 1], table[:, 2], table[:, 3]


def _plan(checked: CheckedDesign, distance: Floats, slab: tuple[float, float], far: float) -> Floats:
    """How many points of a slab stand over each cell (y upwards, x to the right) of the floor."""
    slope = np.tan(np.radians(checked.maps.elevation_upper_deg))[:, None]
    azimuth = np.radians(checked.maps.azimuth_deg)[None, :]
    height = checked.design.views.upper.viewpoint_mm + distance * slope
    inside = np.isfinite(distance) & (height >= slab[0]) & (height <= slab[1])
    x, y = (distance * np.cos(azimuth))[inside], (distance * np.sin(azimuth))[inside]
    edges = np.linspace(-far, far, 301)
    return np.asarray(np.histogram2d(y, x, bins=(edges, edges))[0])


def _disparity_picture(checked: CheckedDesign, limits: tuple[float, float]) -> tuple[Any, tuple[float, float], Any]:
    disparity = _reduced(checked.maps.disparity)
    known = np.isfinite(disparity)
    ends = np.percentile(disparity[known], (0.5, 99.5)) if known.any() else (0.0, 1.0)
    scale = ScalarMappable(Normalize(float(ends[0]), float(ends[1])), colormaps["viridis"])
    picture = scale.to_rgba(np.where(known, disparity, 0.0), bytes=True)
    picture[~known] = (0, 0, 0, 255)
    return picture, limits, scale


def _error_picture(checked: CheckedDesign, limits: tuple[float, float]) -> tuple[Any, tuple[float, float], Any]:
    error = _reduced(checked.relative_error / checked.maps.predicted)
    judged = _reduced(checked.maps.both_see)
    scale = ScalarMappable(Normalize(-ERROR_SIGMAS, ERROR_SIGMAS), colormaps["RdBu_r"])
    picture = scale.to_rgba(np.nan_to_num(error), bytes=True)
    picture[~np.isfinite(error)] = (150, 150, 150, 255)
    picture[~judged] = (255, 255, 255, 255)
    return picture, limits, scale


def _grey(panorama: Image) -> Image:
    reduced = cv2.resize(panorama, _reduced_size(panorama.shape), interpolation=cv2.INTER_AREA)
    return np.repeat(reduced[..., None], 3, axis=-1)


def _reduced(values: NDArray[Any]) -> NDArray[Any]:
    """Every so many samples; averages would mix what was dropped with what was not."""
    width, height = _reduced_size(values.shape)
    rows = ((np.arange(height) + 0.5) * values.shape[0] / height).astype(int)
    columns = ((np.arange(width) + 0.5) * values.shape[1] / width).astype(int)
    return np.asarray(values[np.ix_(rows, columns)])


def _reduced_size(shape: tuple[int, ...]) -> tuple[int, int]:
    rows, columns = shape
    width = min(columns, STRIP_COLUMNS)
    return width, max(round(rows * width / columns), 1)


def _limits(elevation_deg: Floats) -> tuple[float, float]:
    """Lowest and highest elevation of a panorama, to the edges of its rows."""
    half = abs(elevation_deg[0] - elevation_deg[-1]) / (len(elevation_deg) - 1) / 2.0
    return float(elevation_deg[-1] - half), float(elevation_deg[0] + half)


def _nice_ticks(low: float, high: float) -> list[float]:
    decade = 10.0 ** np.floor(np.log10(low))
    marks = [decade * step for step in (1, 1.5, 2, 3, 4, 5, 7, 10, 15, 20, 30, 40, 50, 70, 100)]
    return [float(mark) for mark in marks if low * 0.999 <= mark <= high * 1.001]
