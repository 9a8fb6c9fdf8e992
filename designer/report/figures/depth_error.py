"""Relative depth error against distance: first order, its honesty limit, and a Monte Carlo through the tracer."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from designer.design import Design
from designer.evaluate.depth import FIRST_ORDER_BOUND, depth_error_map, noise_mm_of, second_order, stereo_pair_of
from designer.report.figures.style import BLUE, GREEN, GREY, INK, VERMILLION, length_unit, new_figure
from designer.verify.montecarlo import depth_error_by_distance

MONTE_CARLO_SAMPLES = 2000
"""Noisy projections at each distance: the error bar of an rms is then 1.6 percent."""

_TICK_GRIDS = (
    (1.0,),
    (1.0, 3.0),
    (1.0, 2.0, 5.0),
    (1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0),
)

BOUND_IN_SIGHT = 2.0
"""The honesty limit is drawn when the errors come within this factor of it."""


def draw_depth_error(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw sigma_D / D in percent over the working distances, at the lowest, middle and highest elevation.

    The points are noisy projections traced at random elevations; the thick grey line is first order, rms over
    elevation, which they should meet as long as it stays below the honesty limit; beyond it second order is drawn too.
    """
    uncertainties = (noise_mm_of(design), design.scale_uncertainty)
    pair = stereo_pair_of(design)
    low, high = design.working_volume.elevation_deg
    near, far = design.working_volume.distance_mm
    distances = np.geomspace(near, far, 120)
    unit_mm, unit = length_unit(far)
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for elevation, colour, style in ((low, VERMILLION, "--"), ((low + high) / 2, GREEN, "-."), (high, BLUE, "-")):
        error = depth_error_map(pair, np.radians(elevation), distances, *uncertainties)
        label = f"{elevation:g}°".replace("-", "−")
        axes.plot(distances / unit_mm, 100 * error, color=colour, linestyle=style, label=label, linewidth=1.0)
    elevations = np.radians(np.linspace(low, high, 33))[:, None]
    errors = depth_error_map(pair, elevations, distances, *uncertainties)
    rms = np.sqrt(np.mean(errors**2, axis=0))
    axes.plot(distances / unit_mm, 100 * rms, color=GREY, linewidth=2.6, alpha=0.5, label="rms", zorder=1)
    if rms.max() > FIRST_ORDER_BOUND:
        further = np.sqrt(np.mean(second_order(errors) ** 2, axis=0))
        axes.plot(
            distances / unit_mm, 100 * further, color=GREY, linewidth=1.0, linestyle=(0, (6, 2)), label="rms, 2nd order"
        )
    sampled = np.geomspace(near, far, 6)
    traced = depth_error_by_distance(design, sampled, samples=MONTE_CARLO_SAMPLES, seed=0)
    axes.plot(sampled / unit_mm, 100 * traced, "o", color=INK, markersize=3.5, markerfacecolor="none", label="traced")
    axes.set_xscale("log")
    axes.set_yscale("log")
    if axes.get_ylim()[1] > 100 * FIRST_ORDER_BOUND / BOUND_IN_SIGHT:
        axes.axhline(100 * FIRST_ORDER_BOUND, color=INK, linewidth=0.8, linestyle=":", label="first-order limit")
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(plain)
        axis.set_minor_formatter(NullFormatter())
    axes.set_xticks(_round_ticks(near / unit_mm, far / unit_mm))
    axes.set_yticks(_round_ticks(*axes.get_ylim()))
    axes.grid(True)
    axes.set_xlabel(f"distance from the axis $D$ ({unit})")
    axes.set_ylabel("depth error $\\sigma_D/D$ (%)")
    figure.legend(loc="outside upper center", ncols=3, columnspacing=1.0)
    return figure


def _round_ticks(low: float, high: float) -> list[float]:
    """Round values within a range, on the coarsest of a few grids that has at least three; else the range's ends."""
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    for digits in _TICK_GRIDS:
        ticks = [float(f"{digit * 10.0**power:.6g}") for power in powers for digit in digits]
        within = [tick for tick in ticks if low * 0.999 <= tick <= high * 1.001]
        if len(within) >= 3:
            return within
    return [float(f"{low:.2g}"), float(f"{high:.2g}")]
