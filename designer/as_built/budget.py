"""The cheapest classes of tolerances with which enough sensors are good.

Each tolerance that a file leaves open is given one of the grades as its class, at that class's cost. To first order the
mean square of the depth bias is the sum of the tolerances' squares, each with a weight of its own, and so is the
variance of the blur: for a bound on both, the cheapest classes are a small integer program. How far below its limit
the mean square has to stay for the yield asked depends on how many departures share it; the bound is found by
bisection, with the yield of traced sensors as the judge (docs/theory.md, section 11).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
    tolerance_of_grade,
    tolerance_values,
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
class ChosenClass:
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
    choices: tuple[ChosenClass, ...]
    cost: float
    cost_of_class: dict[Grade, float]


@dataclass(frozen=True, slots=True, eq=False)
class _Allocation:
    """What is to be allocated, and what judges it: ``given`` (parameters,) are tolerances where no item chooses."""

    model: Perturbable
    items: tuple[Item, ...]
    given: Array
    weights: Array
    growth: float
    seed: int
    align: int | None

    def yield_of(self, classes: Array, trials: int) -> Yield:
        """The yield of traced sensors with a class (items,) for each item."""
        sizes = self.given.copy()
        for item, chosen in zip(self.items, classes, strict=True):
            sizes[list(item.places)] = item.sizes[chosen]
        return simulate(self.model, sizes, self.growth, trials, self.seed, self.align).result

    def cost(self, classes: Array) -> float:
        """The sum of the classes' costs."""
        return float(sum(item.costs[k] for item, k in zip(self.items, classes, strict=True)))


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
    trials
        Sensors that judge the result; the search itself traces fewer.
    align
        The place of a departure that is adjusted at assembly; it needs no tolerance.
    """
    growth = growth_of(tolerances)
    given = tolerance_values(model.design, model.parameters, tolerances)
    items = tuple(_items(model, tolerances, align))
    allocation = _Allocation(model, items, given, _weights(model, impacts, growth), growth, seed, align)
    cost_of_class = {grade: allocation.cost(np.full(len(items), k)) for k, grade in enumerate(CLASSES)}
    classes = np.full(len(items), len(CLASSES) - 1)
    reached = allocation.yield_of(classes, trials)
    if reached.value < asked:
        return Budget(asked, reached, (), cost_of_class[CLASSES[-1]], cost_of_class)
    aim = asked
    for _ in range(ATTEMPTS):
        found = _search(allocation, aim, min(trials, SEARCH_TRIALS))
        judged = allocation.yield_of(found, trials)
        if judged.value >= asked:
            classes, reached = found, judged
            break
        aim = min(aim + (asked - judged.value) + AIM_STEP, 1.0)
    choices = tuple(_choice(item, int(chosen)) for item, chosen in zip(items, classes, strict=True))
    return Budget(asked, reached, choices, allocation.cost(classes), cost_of_class)


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


def _search(allocation: _Allocation, aim: float, trials: int) -> Array:
    """The cheapest classes (items,) found with which a share of so many sensors is good; else the finest."""
    best = np.full(len(allocation.items), len(CLASSES) - 1)
    loose, tight = np.log(LOOSEST), np.log(TIGHTEST)
    for _ in range(HALVINGS):
        middle = (loose + tight) / 2.0
        classes = _cheapest(allocation, float(np.exp(middle)))
        if classes is None or allocation.yield_of(classes, trials).value >= aim:
            # Too tight for the finest class, or tight enough.
            tight = middle
            if classes is not None and allocation.cost(classes) <= allocation.cost(best):
                best = classes
        else:
            loose = middle
    return _loosened(allocation, best, aim, trials)


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


def _cheapest(allocation: _Allocation, bound: float) -> Array | None:
    """The cheapest class (items,) of each tolerance that keeps both mean squares within a bound; None if none does."""
    items, weights, count = allocation.items, allocation.weights, len(CLASSES)
    squares = np.array(
        [
            [float(item.sizes[k] ** 2 @ row[list(item.places)]) for item in items for k in range(count)]
            for row in weights
        ]
    )
    chosen = [place for item in items for place in item.places]
    rest = np.delete(allocation.given, chosen) ** 2 @ np.delete(weights, chosen, axis=1).T
    if np.any(bound - rest < 0.0):
        return None
    one_each = np.kron(np.eye(len(items)), np.ones(count))
    found = milp(
        np.concatenate([item.costs for item in items]),
        integrality=np.ones(count * len(items), dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        constraints=[LinearConstraint(one_each, 1.0, 1.0), LinearConstraint(squares, -np.inf, bound - rest)],
    )
    return None if found.x is None else np.argmax(found.x.reshape(len(items), count), axis=1)


def _loosened(allocation: _Allocation, classes: Array, aim: float, trials: int) -> Array:
    """Each tolerance in turn one class coarser, the greatest saving first, where enough sensors stay good."""
    chosen = zip(allocation.items, classes, strict=True)
    savings = np.array([item.costs[k] - item.costs[max(k - 1, 0)] for item, k in chosen])
    for place in np.argsort(-savings, kind="stable"):
        if savings[place] <= 0.0:
            break
        tried = classes.copy()
        tried[place] -= 1
        if allocation.yield_of(tried, trials).value >= aim:
            classes = tried
    return classes


def _choice(item: Item, chosen: int) -> ChosenClass:
    grade = CLASSES[chosen]
    return ChosenClass(
        item.part, item.key, grade, tolerance_of_grade(grade, item.part, item.key), float(item.costs[chosen])
    )
