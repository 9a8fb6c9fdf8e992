"""The cheapest classes of tolerances with which enough sensors are good.

Each tolerance that a file leaves open is given one of the grades as its class, at that class's cost. To first order the
mean square of the depth bias is the sum of the tolerances' squares, each with a weight of its own, and so is the
variance of the blur: for a bound on both, the cheapest classes are a small integer program. How far below its limit
the mean square has to stay for the yield asked depends on how many departures share it; the bound is found by
bisection, with the yield of traced sensors as the judge (docs/theory.md, section 11).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

from designer.as_built.dual import Array
from designer.as_built.model import Perturbable
from designer.as_built.parameters import CAMERA
from designer.as_built.sensitivity import Impact
from designer.as_built.tolerances import (
    GRADES,
    Grade,
    Tolerances,
    growth_of,
    is_open,
    key_of,
    tolerance_values,
    value_of,
)
from designer.as_built.yields import CUT_OFF, Yield, simulate

CLASSES: tuple[Grade, ...] = tuple(GRADES)
"""From the cheapest to the dearest."""
HALVINGS = 10
# Sensors that are traced for each trial allocation; the last ones are judged by all.
SEARCH_TRIALS = 2000
# By how much more the search aims where its sensors were luckier than all.
ATTEMPTS, AIM_STEP = 4, 0.001
# Of the mean square over its limit: from where next to no sensor is good to where next to all are.
LOOSEST, TIGHTEST = 10.0, 0.02


@dataclass(frozen=True, slots=True)
class Item:
    """A tolerance that a workshop quotes: of a part, under a key of the tolerance file; ``places`` are its departures.

    ``sizes`` (classes, places) are the tolerances in the departures' units, ``costs`` (classes,) what each costs.
    """

    part: str
    key: str
    places: tuple[int, ...]
    sizes: Array
    costs: Array


@dataclass(frozen=True, slots=True)
class Choice:
    """The class of one tolerance, its value in the unit of its key, and its cost."""

    part: str
    key: str
    chosen: Grade
    value: float
    cost: float


@dataclass(frozen=True, slots=True)
class Budget:
    """The cheapest classes found.

    ``asked`` is the yield asked for. ``reached`` is that of traced sensors with these classes, or with the finest class
    throughout if not even that is enough: then there are no ``choices``. ``cost_of_class`` is the cost of giving every
    tolerance the same class.
    """

    asked: float
    reached: Yield
    choices: tuple[Choice, ...]
    cost: float
    cost_of_class: dict[Grade, float]


def allocate(
    model: Perturbable,
    tolerances: Tolerances,
    impacts: list[Impact],
    asked: float,
    trials: int,
    seed: int,
    align: int | None = None,
) -> Budget:
    """Find the cheapest classes for every tolerance that the file does not set.

    Parameters
    ----------
    impacts
        Of all departures, in any order, for the growth asked: see
        :func:`designer.as_built.sensitivity.sensitivities`.
    asked
        The share of sensors that are to be good.
    align
        The place of a departure that is adjusted at assembly; it needs no tolerance.
    """
    growth = growth_of(tolerances)
    given = tolerance_values(model.design, model.parameters, tolerances)
    items = list(_items(model, tolerances, align))
    weights = _weights(model, impacts, growth)

    def sizes_of(classes: Array) -> Array:
        sizes = given.copy()
        for item, chosen in zip(items, classes, strict=True):
            sizes[list(item.places)] = item.sizes[chosen]
        return sizes

    def yield_of(classes: Array) -> Yield:
        return simulate(model, sizes_of(classes), growth, trials, seed, align).result

    finest = np.full(len(items), len(CLASSES) - 1)
    cost_of_class = {grade: float(sum(item.costs[k] for item in items)) for k, grade in enumerate(CLASSES)}
    best, reached = finest, yield_of(finest)
    if reached.value < asked:
        return Budget(asked, reached, (), cost_of_class[CLASSES[-1]], cost_of_class)
    loose, tight = np.log(LOOSEST), np.log(TIGHTEST)
    for _ in range(HALVINGS):
        middle = (loose + tight) / 2.0
        classes = _cheapest(items, weights, given, float(np.exp(middle)))
        if classes is None:  # not even the finest class keeps so tight a bound
            tight = middle
            continue
        found = yield_of(classes)
        if found.value >= asked:
            tight = middle
            if _cost(items, classes) <= _cost(items, best):
                best, reached = classes, found
        else:
            loose = middle
    best, reached = _loosened(items, best, reached, asked, yield_of)
    choices = tuple(_choice(item, int(chosen)) for item, chosen in zip(items, best, strict=True))
    return Budget(asked, reached, choices, _cost(items, best), cost_of_class)


def fulfilled(
    model: Perturbable,
    tolerances: Tolerances,
    impacts: list[Impact],
    asked: float,
    trials: int,
    seed: int,
    align: int | None = None,
) -> Budget:
    """The cheapest classes with which as many of so many ``trials`` are good, found with fewer of them.

    Parameters are those of :func:`allocate`.
    """
    aim = asked
    for _ in range(ATTEMPTS):
        budget = allocate(model, tolerances, impacts, aim, min(trials, SEARCH_TRIALS), seed, align)
        if not budget.choices:
            break
        chosen = tolerance_values(model.design, model.parameters, tolerances_of(budget, tolerances))
        reached = simulate(model, chosen, growth_of(tolerances), trials, seed, align).result
        budget = replace(budget, asked=asked, reached=reached)
        if reached.value >= asked:
            return budget
        aim = min(aim + (asked - reached.value) + AIM_STEP, 1.0)
    finest = tolerances.model_copy(update={"grade": CLASSES[-1]})
    values = tolerance_values(model.design, model.parameters, finest)
    reached = simulate(model, values, growth_of(tolerances), trials, seed, align).result
    return replace(budget, asked=asked, reached=reached, choices=(), cost=budget.cost_of_class[CLASSES[-1]])


def tolerances_of(budget: Budget, tolerances: Tolerances) -> Tolerances:
    """The tolerances of a file, with those chosen filled in; the same sensors are good with it."""
    mirrors: dict[str, dict[str, float]] = {}
    for choice in budget.choices:
        mirrors.setdefault(choice.part, {})[choice.key] = choice.value
    content = tolerances.model_dump(exclude_none=True, exclude={"cost"})
    camera = content["camera"] | mirrors.pop(CAMERA, {})
    names = {*content["mirror"], *mirrors}
    mirror = {name: content["mirror"].get(name, {}) | mirrors.get(name, {}) for name in sorted(names)}
    return Tolerances.model_validate(content | {"camera": camera, "mirror": mirror})


def _items(model: Perturbable, tolerances: Tolerances, align: int | None) -> Iterator[Item]:
    """Every tolerance that the file leaves open, with the departures that it bounds."""
    places: dict[tuple[str, str], list[int]] = {}
    for place, parameter in enumerate(model.parameters):
        if place != align:
            places.setdefault((parameter.part, key_of(parameter)), []).append(place)
    of_classes = [
        tolerance_values(model.design, model.parameters, tolerances.model_copy(update={"grade": grade}))
        for grade in CLASSES
    ]
    for (part, key), found in places.items():
        if is_open(tolerances, part, key):
            costs = tolerances.cost.of.get(key, tolerances.cost)
            yield Item(
                part,
                key,
                tuple(found),
                np.array([values[found] for values in of_classes]),
                np.array([getattr(costs, grade) for grade in CLASSES]),
            )


def _weights(model: Perturbable, impacts: list[Impact], growth: float) -> Array:
    """What the square of each tolerance adds to the mean squares, as shares of their limits: (2, parameters).

    The first row is the depth bias: its limit is where the depth error has grown by the share. The second is the blur:
    a departure that alone reaches the limit counts as 1. The spread of a departure is half its tolerance.
    """
    limit = model.noise**2 * ((1.0 + growth) ** 2 - 1.0)
    bias = model.depth_bias_left**2 @ model.grid.weights / limit
    blur = np.zeros(len(model.parameters))
    places = {parameter: place for place, parameter in enumerate(model.parameters)}
    for impact in impacts:
        if impact.allowed_by == "blur" and impact.allowed:
            blur[places[impact.parameter]] = impact.allowed**-2
    return np.array([bias, blur]) / CUT_OFF**2


def _cheapest(items: list[Item], weights: Array, given: Array, bound: float) -> Array | None:
    """The cheapest class (items,) of each tolerance that keeps both mean squares within a bound; None if none does."""
    costs = np.concatenate([item.costs for item in items])
    count = len(CLASSES)
    squares = np.array(
        [
            [float(item.sizes[k] ** 2 @ row[list(item.places)]) for item in items for k in range(count)]
            for row in weights
        ]
    )
    chosen = [place for item in items for place in item.places]
    rest = np.delete(given, chosen) ** 2 @ np.delete(weights, chosen, axis=1).T
    if np.any(bound - rest < 0.0):
        return None
    one_each = np.kron(np.eye(len(items)), np.ones(count))
    found = milp(
        costs,
        integrality=np.ones(costs.size, dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        constraints=[LinearConstraint(one_each, 1.0, 1.0), LinearConstraint(squares, -np.inf, bound - rest)],
    )
    return None if found.x is None else np.argmax(found.x.reshape(len(items), count), axis=1)


def _loosened(
    items: list[Item], classes: Array, reached: Yield, asked: float, yield_of: Callable[[Array], Yield]
) -> tuple[Array, Yield]:
    """Each tolerance in turn one class coarser, the greatest saving first, where enough sensors stay good."""
    savings = [
        (float(item.costs[k] - item.costs[k - 1]), -place)
        for place, (item, k) in enumerate(zip(items, classes, strict=True))
        if k > 0
    ]
    for saving, place in sorted(savings, reverse=True):
        tried = classes.copy()
        tried[-place] -= 1
        found = yield_of(tried)
        if saving > 0.0 and found.value >= asked:
            classes, reached = tried, found
    return classes, reached


def _choice(item: Item, chosen: int) -> Choice:
    grade = CLASSES[chosen]
    return Choice(item.part, item.key, grade, value_of(grade, item.part, item.key), float(item.costs[chosen]))


def _cost(items: list[Item], classes: Array) -> float:
    return float(sum(item.costs[k] for item, k in zip(items, classes, strict=True)))
