"""A design ready to be perturbed: its grid and its derivatives, and built systems measured on them.

What is computed once of a design serves any number of built systems.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np
from pydantic import ValidationError

from designer.as_built.compensation import (
    Calibration,
    best_alignment,
    calibrated,
    centres_apart_px,
    left_by_calibration,
)
from designer.as_built.dual import Array
from designer.as_built.merits import Grid, Merits, errors_of, first_order_errors, grid_of, merits_of
from designer.as_built.parameters import Parameter, as_built_record, parameters_of
from designer.as_built.projection import Linear, Projection, linearise, project
from designer.as_built.sharpness import SharpPoints, blur_of_limit, sharp_points
from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.depth import depth_error_rms, noise_mm_of, stereo_pair_of, volume_of
from designer.files import InputError, describe_validation_error

# Systems measured together: their image places fill a few MB.
SYSTEMS_PER_BLOCK = 250


@dataclass(frozen=True, slots=True, eq=False)
class Perturbable:
    """A design, the departures that it can have, its grid, and how its images change with the departures.

    ``noise`` is the relative depth error that the design has without departures, root mean square over the working
    volume. ``epipolar_px`` and ``depth_bias`` (parameters, n) are derivatives of the errors at each point, ``_left`` of
    what calibration leaves of them. ``sharp`` are the points whose blur is judged; None if the design bounds no blur.
    """

    design: Design
    parameters: tuple[Parameter, ...]
    grid: Grid
    linear: dict[ViewName, Linear]
    calibration: Calibration
    noise: float
    epipolar_px: Array
    depth_bias: Array
    depth_bias_left: Array
    sharp: dict[ViewName, SharpPoints] | None


@dataclass(frozen=True, slots=True)
class Measured:
    """Merits of T systems read by the design's own tables, and by those of a calibrated image.

    ``values`` (T, parameters) are the departures, after alignment if there was one; ``centres_apart_px`` (T,) the
    distance between the image centres of the two views; ``blur_of_limit`` (T,) the largest ratio of a blur to what the
    design allows, zero if it says nothing.
    """

    values: Array
    centres_apart_px: Array
    before: Merits
    after: Merits
    blur_of_limit: Array


def perturbable(design: Design, calibration: Calibration = "views") -> Perturbable:
    """Prepare a design for sensors that are calibrated in one way; its own ``as_built`` table does not count.

    Raises
    ------
    InputError
        Its views do not show its whole working volume.
    """
    grid = grid_of(design)
    try:
        linear = {view: linearise(design, view, grid.targets[view]) for view in VIEW_NAMES}
        sharp = sharp_points(design)
    except ValueError as error:
        raise InputError(f"{error} of the working volume, so its tolerances mean nothing") from None
    before = first_order_errors(design, grid, {view: linear[view].pixels for view in VIEW_NAMES})
    changes = {view: linear[view].pixels.transpose(1, 0, 2) for view in VIEW_NAMES}
    left, _ = left_by_calibration(design, grid, changes, calibration)
    _, bias_left = first_order_errors(design, grid, {view: left[view].transpose(1, 0, 2) for view in VIEW_NAMES})
    noise = depth_error_rms(stereo_pair_of(design), volume_of(design), noise_mm_of(design), design.scale_uncertainty)
    return Perturbable(
        design, parameters_of(design), grid, linear, calibration, float(noise), *before, bias_left, sharp
    )


def measure(
    model: Perturbable,
    values: Array,
    align: int | None = None,
    image_shift_px: tuple[float, float] = (0.0, 0.0),
) -> Measured:
    """Trace built systems of departures (T, parameters), whose images lie displaced on the chip.

    ``align`` is the place of a parameter that is set so that calibration leaves the least, before systems are
    calibrated.
    """
    blocks = [values[low : low + SYSTEMS_PER_BLOCK] for low in range(0, len(values), SYSTEMS_PER_BLOCK)]
    # NumPy leaves the interpreter free while it works on arrays.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(pool.map(lambda block: _measure_block(model, block, align, image_shift_px), blocks))
    return Measured(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.centres_apart_px for part in parts]),
        _joined([part.before for part in parts]),
        _joined([part.after for part in parts]),
        np.concatenate([part.blur_of_limit for part in parts]),
    )


def first_order_bias(model: Perturbable, values: Array, align: int | None = None) -> Array:
    """Root mean square depth bias (T,) that calibration leaves, to first order in departures (T, parameters).

    ``align`` is as for :func:`measure`.
    """
    if align is not None:
        bias = values @ model.depth_bias_left
        values = values.copy()
        values[:, align] += best_alignment(model.grid, bias, model.depth_bias_left[align])
    return np.asarray(np.sqrt((values @ model.depth_bias_left) ** 2 @ model.grid.weights))


def depth_error(model: Perturbable, depth_bias: Array) -> Array:
    """Relative depth error of noise and bias together, root mean square over the working volume."""
    return np.hypot(model.noise, depth_bias)


def with_departures(design: Design, values: Array) -> Design:
    """The design with an ``as_built`` table of departures (parameters,), validated as its file's would be.

    Raises
    ------
    InputError
        No design file can hold such departures.
    """
    try:
        record = as_built_record(design, values).model_dump()
        return Design.model_validate({**design.model_dump(by_alias=True), "as_built": record})
    except ValidationError as error:
        raise InputError(describe_validation_error("departures", error)) from None


def _measure_block(
    model: Perturbable, values: Array, align: int | None, image_shift_px: tuple[float, float]
) -> Measured:
    design, grid = model.design, model.grid
    projections = _projections(model, values)
    if align is not None:
        _, bias = errors_of(design, grid, _calibrated_pixels(model, projections))
        values = values.copy()
        values[:, align] += best_alignment(grid, bias, model.depth_bias_left[align])
        projections = _projections(model, values)
    shift = np.array(image_shift_px)[:, None, None]
    pixels = {view: projections[view].pixels + shift for view in VIEW_NAMES}
    return Measured(
        values,
        centres_apart_px(design, grid, pixels),
        merits_of(design, grid, pixels, projections),
        merits_of(design, grid, _calibrated_pixels(model, projections), projections),
        blur_of_limit(design, model.sharp, values),
    )


def _calibrated_pixels(model: Perturbable, projections: Mapping[ViewName, Projection]) -> dict[ViewName, Array]:
    pixels = {view: projections[view].pixels for view in VIEW_NAMES}
    return calibrated(model.design, model.grid, pixels, model.calibration)


def _projections(model: Perturbable, values: Array) -> dict[ViewName, Projection]:
    return {
        view: project(model.design, view, model.grid.targets[view], values, model.linear[view]) for view in VIEW_NAMES
    }


def _joined(parts: list[Merits]) -> Merits:
    return Merits(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Merits)))
