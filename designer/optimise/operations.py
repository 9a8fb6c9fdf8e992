"""A problem's rules and score as lists of elementary operations: what a proof evaluates on boxes of designs.

The geometry is the one that designs are optimised with, written once: CasADi records its operations, and
:mod:`designer.certify` evaluates them with intervals in the place of numbers. Plain arrays leave this module.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from designer.evaluate.depth import depth_error_of_slopes, depth_shift_per_scale, slopes_of_point, volume_nodes
from designer.evaluate.predicted_noise import seen_through
from designer.optics.backend import Scalar, absolute, maximum, minimum, sqrt
from designer.optics.clearance import pair_up
from designer.optics.layout import Leg, Solid
from designer.optimise.limit import conditions_of
from designer.optimise.problem import Problem
from designer.optimise.system import System, put_together
from designer.optimise.variables import VARIABLES, with_principal_distance

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CODES = tuple(
    "CONST INPUT ADD SUB MUL DIV NEG SQ SQRT INV FABS FMAX FMIN EXP ATAN LT LE NOT AND OR IF_ELSE_ZERO".split()  # noqa: SIM905
)
"""Operations by their number, as CasADi calls them."""

NODE_ROWS = (
    "mean_along",
    "mean_across",
    "lower_smoothing",
    "upper_smoothing",
    "across_smoothing",
    "template",
    "lower_pixel",
    "upper_pixel",
    "lower_rounding",
    "upper_rounding",
    "scale",
    "edge",
    "fixed",
)
"""What the score needs at each node, in this order; see :func:`_node_rows`."""


@dataclass(frozen=True, slots=True)
class Operations:
    """A list of operations on earlier ones: ``codes`` into ``CODES``, the places of both operands, and constants.

    ``results`` are the places of what is wanted.
    """

    codes: Indices
    first: Indices
    second: Indices
    constants: Array
    results: Indices


@dataclass(frozen=True, slots=True)
class Statement:
    """What is to be proved about a variant: its variables and their ranges, its rules, and the parts of its score.

    Attributes
    ----------
    variables, low, high
        The free variables in physical units; what encloses the mirrors follows from them.
    rules, kinds, names, is_equality
        Scaled values that must not be negative (or must be zero), the kind and the name of each.
    score
        ``NODE_ROWS`` for each node of the working volume, one node after the other.
    weights, texture
        The nodes' weights, which add up to 1; contrast squared and the two squared wave numbers of the texture.
    """

    variables: tuple[str, ...]
    low: Array
    high: Array
    rules: Operations
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    is_equality: NDArray[np.bool_]
    score: Operations
    weights: Array
    texture: Array


def state(problem: Problem, dropped: Collection[str] = (), *, is_conflict: bool = False) -> Statement:
    """What is to be proved about a problem, without the rules of the kinds ``dropped``.

    A conflict needs no score, which is then left out. Two blurs are then compared at the smallest stop alone, where
    they are least: that rule holds or fails for every stop at once.
    """
    free = _free_variables(problem)
    symbols = casadi.SX.sym("variables", len(free))
    values = with_principal_distance(
        {
            variable.name: symbols[free.index(variable.name)]
            if variable.name in free
            else casadi.SX(problem.bounds[variable.name].low)
            for variable in VARIABLES
        }
    )
    loose = put_together(problem.variant, values, problem.specification)
    # A housing may be wider than it must be, so that of its room nothing is known.
    size = loose.layout.size(problem.specification.lens_front)
    system = replace(loose, values={**values, "top": size.top, "bottom": size.bottom, "radius": size.radius})
    rules = [rule for rule in _rules(problem, system, is_conflict) if rule[0] not in dropped]
    ends = [_range(problem, name) for name in free]
    rows, weights = ([casadi.SX(0.0)], np.ones(1)) if is_conflict else _score(system)
    contrast, fine, coarse = _texture(system)
    return Statement(
        free,
        np.array([low for low, _ in ends]),
        np.array([high for _, high in ends]),
        _operations(symbols, [value for _, _, value, _ in rules]),
        tuple(kind for kind, _, _, _ in rules),
        tuple(name for _, name, _, _ in rules),
        np.array([is_equality for _, _, _, is_equality in rules]),
        _operations(symbols, rows),
        weights,
        np.array([contrast, fine, coarse]),
    )


def _free_variables(problem: Problem) -> tuple[str, ...]:
    fold = problem.variant.fold
    unused = {"secondary_height", "secondary_inverse_gain"} if fold is None else set()
    if fold is not None and fold.primary_is_plane:
        unused = {"secondary_inverse_gain"}
    return tuple(
        variable.name
        for variable in VARIABLES
        if variable.role == "shape" and variable.name not in unused and not problem.bounds[variable.name].is_fixed
    )


def _range(problem: Problem, name: str) -> tuple[float, float]:
    bounds = problem.bounds[name]
    ends = [float(end) for end in (bounds.low, bounds.high, bounds.least, bounds.greatest) if end is not None]
    return min(ends), max(ends)


def _rules(problem: Problem, system: System, is_conflict: bool) -> list[tuple[str, str, Any, bool]]:
    """Kind, name, scaled value and whether it is an equality, of every rule that a proof knows."""
    rules = [
        (each.kind, each.name, each.value / each.scale, each.equality)
        for each in problem.constraints(system)
        # What encloses the mirrors is put where they end.
        if each.kind not in {"encloses", "housing_body"}
    ]
    f_number = problem.bounds["f_number"].high if is_conflict else system.values["f_number"]
    rules += [("blur", name, value, False) for name, value in _blurs_in_pairs(system, f_number)]
    pairs = pair_up(system.layout)
    for name, (leg, solid) in zip(pairs.names, pairs.leg_solid, strict=False):
        if _is_beside(pairs.legs[leg], pairs.solids[solid]):
            spare = (
                _most_separation(pairs.legs[leg], pairs.solids[solid])
                - problem.specification.asked.manufacture.clearance_mm
            )
            rules.append(("clearance", name, spare, False))
    return [rule for rule in rules if not isinstance(rule[2], float)]


def _blurs_in_pairs(system: System, f_number: Scalar) -> list[tuple[str, Any]]:
    """That two virtual images lie no farther apart than both blurs allow: follows from both, for any focus."""
    asked = system.specification
    if not asked.law.is_perspective:
        return []
    width = replace(system.lens, f_number=f_number).pupil_diameter * system.values["principal_distance"]
    ends = [blur for blur in system.blurs if blur.place != 1]
    limits = [minimum(asked.largest_blur, asked.largest_blur_angle * blur.image_scale) for blur in ends]
    rows = []
    for (first, of_first), (second, of_second) in combinations(zip(ends, limits, strict=True), 2):
        apart = width * absolute(first.reciprocal_depth - second.reciprocal_depth)
        name = f"blur of the {first.view} and the {second.view} view at one focus"
        rows.append((name, (of_first + of_second - apart) / asked.pixel_pitch / 2.0))
    return rows


def _is_beside(leg: Leg, solid: Solid) -> bool:
    """Whether a leg from the pinhole could pass a mirror on its side of the axis: an edge between the zones."""
    return leg.leaves_pinhole and solid.side == leg.end.side and solid.name not in {"lens", "body"}


def _most_separation(leg: Leg, solid: Solid) -> Scalar:
    """The separation of the corners of a leg and a solid along the best direction: never less than that of the bodies.

    The directions are those of :data:`designer.optics.clearance.LEG_DIRECTIONS`.
    """
    light = [point for end in (leg.start, leg.end) for point in end.points]
    body = []
    for radius in (solid.inner_radius, solid.outer_radius):
        height = solid.surface.height(radius)
        body += [(solid.side * radius, height), (solid.side * radius, height + solid.depth)]
    chords = (
        (light[0], light[2]),
        (light[1], light[3]),
        (light[2], light[3]),
        (light[0], light[1]),
        (body[0], body[2]),
    )
    gaps = []
    for start, end in chords:
        across, along = end[0] - start[0], end[1] - start[1]
        length = sqrt(across * across + along * along)
        beside = [
            [across * (point[1] - start[1]) - along * (point[0] - start[0]) for point in points]
            for points in (light, body)
        ]
        gaps += [gap / length for gap in _gaps(*beside)]
    for axis in (0, 1):
        gaps += _gaps([point[axis] for point in light], [point[axis] for point in body])
    largest = gaps[0]
    for gap in gaps[1:]:
        largest = maximum(largest, gap)
    return largest


def _gaps(first: list[Scalar], second: list[Scalar]) -> list[Scalar]:
    """How far the second lies beyond the first along a direction, and against it."""
    return [_extreme(second, minimum) - _extreme(first, maximum), _extreme(first, minimum) - _extreme(second, maximum)]


def _extreme(values: list[Scalar], pick: Any) -> Scalar:
    return pick(pick(values[0], values[1]), pick(values[2], values[3]))


def _score(system: System) -> tuple[list[Any], Array]:
    nodes = volume_nodes(system.volume)
    weights = np.array([float(node.weight) for node in nodes])
    rows = [row for node in nodes for row in _node_rows(system, float(node.slope), float(node.distance))]
    return rows, weights / weights.sum()


def _node_rows(system: System, slope: float, distance: float) -> list[Any]:
    """``NODE_ROWS`` at a point: variances in mm^2 on the surface, ``scale``, ``edge`` and ``fixed`` as they are summed.

    The square of sigma_D / D is at least scale (pixel G / S^2 + rounding W / S^2), summed over both views, + edge +
    fixed, with the gradient energies S, W and G of :func:`designer.evaluate.noise.matching_noise`. Aliasing, which adds
    to it, is left out.
    """
    asked, pair = system.specification, system.pair
    slopes = slopes_of_point(slope, distance, pair.baseline)
    constant = depth_error_of_slopes(pair, slopes, asked.noise)
    shift = asked.scale_uncertainty * depth_shift_per_scale(pair, slope, distance)
    fixed = constant * constant + shift * shift
    if not asked.predicted_share:
        return [*[0.0] * (len(NODE_ROWS) - 1), fixed]
    seen = seen_through(conditions_of(asked), pair, system.lens, system.light)(slopes, distance)
    of_upper, of_lower = seen.views.upper, seen.views.lower
    per_baseline = 1.0 / (pair.baseline * pair.baseline)
    return [
        seen.mean_along,
        seen.mean_across,
        of_lower.smoothing,
        of_upper.smoothing,
        seen.across_smoothing,
        seen.template,
        of_lower.raw * of_lower.pixel,
        of_upper.raw * of_upper.pixel,
        of_lower.rounding * seen.row * seen.column,
        of_upper.rounding * seen.row * seen.column,
        per_baseline * seen.loss / seen.area,
        per_baseline * (seen.edge + seen.floor),
        fixed,
    ]


def _texture(system: System) -> tuple[float, float, float]:
    texture = conditions_of(system.specification).texture
    fine, coarse = ((2.0 * np.pi / float(length)) ** 2 for length in (texture.finest_mm, texture.coarsest_mm))
    return float(texture.contrast_per_octave) ** 2 / (4.0 * np.log(2.0)), fine, coarse


def _operations(symbols: Any, rows: list[Any]) -> Operations:
    """The operations that give the rows, with what they share computed once."""
    function = casadi.Function("rows", [symbols], [casadi.vertcat(*rows)], {"cse": True})
    names = {getattr(casadi, name): name.removeprefix("OP_") for name in dir(casadi) if name.startswith("OP_")}
    places: dict[int, int] = {}
    results = np.zeros(len(rows), dtype=np.int64)
    listed: list[tuple[int, int, int, float]] = []
    for number in range(function.n_instructions()):
        name = names[function.instruction_id(number)]
        given, made = function.instruction_input(number), function.instruction_output(number)
        if name == "OUTPUT":
            results[made[1]] = places[given[0]]
            continue
        if name == "CONST":
            step = (0, 0, 0, float(function.instruction_constant(number)))
        elif name == "INPUT":
            step = (CODES.index(name), given[1], 0, 0.0)
        elif name == "TWICE":
            step = (CODES.index("ADD"), places[given[0]], places[given[0]], 0.0)
        else:
            operands = [places[place] for place in given]
            step = (CODES.index(name), operands[0], operands[-1], 0.0)
        places[made[0]] = len(listed)
        listed.append(step)
    codes, first, second, constants = zip(*listed, strict=True)
    integers = [np.array(column, dtype=np.int64) for column in (codes, first, second)]
    return Operations(integers[0], integers[1], integers[2], np.array(constants), results)
