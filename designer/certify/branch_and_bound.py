"""Branch and bound over boxes of designs: a lower bound of the score, or that no design keeps the rules."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.certify.boxes import SOURCES, examine
from designer.optimise.operations import Statement

Array = NDArray[np.float64]

# As much as a design may miss a rule by, and is still called feasible (multistart.LARGEST_VIOLATION).
TOLERANCE = 1e-6
BOXES_AT_ONCE = 1024
# Where the rules alone count, any stop and any focus may do: they are cut when others are narrow.
SELDOM_CUT = {"f_number": 16.0, "reciprocal_focus": 8.0}
SHAVINGS = 6
OCTAVE = float(np.log(2.0))
# With fewer open boxes than this memory is no matter; the best are cut first, which raises the bound.
MOST_OPEN_BOXES = 2_000_000


@dataclass(frozen=True, slots=True)
class Outcome:
    """What branch and bound came to.

    ``bound`` is a lower bound of the score: the target, if no box is left, infinite without one. ``is_complete`` tells
    that no box is left; ``boxes`` were examined, ``open_boxes`` are left, in ``seconds`` of processor time.
    """

    bound: float
    is_complete: bool
    boxes: int
    open_boxes: int
    seconds: float


def bound_score(statement: Statement, target: float, seconds: float) -> Outcome:
    """Bound the score of a statement from below, until it reaches the target or the time is over.

    Parameters
    ----------
    target
        Boxes are left as soon as their score is at least this; infinite to ask for the rules alone.
    seconds
        Processor time.
    """
    rules, score = statement.rules, statement.score
    allowed = np.stack(
        [
            np.full(len(statement.kinds), -TOLERANCE),
            np.where(statement.is_equality, TOLERANCE, np.inf),
        ]
    )
    least, greatest = statement.low[None].copy(), statement.high[None].copy()
    bounds, examined = np.zeros(1), 0
    widths = np.maximum(statement.high - statement.low, 1e-300)
    of_rules = (rules.codes, rules.first, rules.second, rules.constants, rules.results, allowed)
    of_score = (score.codes, score.first, score.second, score.constants, score.results)
    nodes = (statement.weights, statement.texture)

    def run(low: Array, high: Array, values: Array) -> NDArray[np.int64]:
        cuts = np.empty(len(values), dtype=np.int64)
        examine(low, high, values, cuts, *of_rules, *of_score, *nodes, target, widths, SOURCES)
        return cuts

    run(least.copy(), greatest.copy(), bounds.copy())  # compiled here: that does not count
    start = time.process_time()
    _shave(run, least, greatest)
    widths = np.maximum(greatest[0] - least[0], 1e-300)
    if not np.isfinite(target):
        widths = widths * np.array([SELDOM_CUT.get(name, 1.0) for name in statement.variables])
    while len(bounds) and time.process_time() - start < seconds:
        taken = _most_urgent(bounds)
        low, high, values = least[taken], greatest[taken], bounds[taken]
        cuts = run(low, high, values)
        examined += len(values)
        open_ones = np.ones(len(bounds), dtype=bool)
        open_ones[taken] = False
        halves = _halves(low, high, values, cuts)
        least = np.concatenate([least[open_ones], halves[0]])
        greatest = np.concatenate([greatest[open_ones], halves[1]])
        bounds = np.concatenate([bounds[open_ones], halves[2]])
        if len(bounds) > MOST_OPEN_BOXES:
            break
    return Outcome(
        float(bounds.min()) if len(bounds) else target,
        not len(bounds),
        examined,
        len(bounds),
        time.process_time() - start,
    )


def _shave(run: Callable[[Array, Array, Array], NDArray[np.int64]], least: Array, greatest: Array) -> None:
    """Take from the ends of a box, in place, the slices that nothing is left of."""
    for _ in range(SHAVINGS):
        moved = False
        for variable in range(least.shape[1]):
            for at_low in (True, False):
                for share in (0.5, 0.2, 0.05):
                    low, high = least.copy(), greatest.copy()
                    edge = _between(low[0, variable], high[0, variable], share if at_low else 1.0 - share)
                    (high if at_low else low)[0, variable] = edge
                    if run(low, high, np.zeros(1))[0] < 0:
                        (least if at_low else greatest)[0, variable] = edge
                        moved = True
                        break
        if not moved:
            return


def _between(first: float, last: float, share: float) -> float:
    """A place between two ends; by their logarithms where they are of one sign and octaves apart."""
    if first * last > 0.0 and abs(np.log(last / first)) > OCTAVE:
        return float(np.sign(last) * abs(first) ** (1.0 - share) * abs(last) ** share)
    return first + share * (last - first)


def _most_urgent(bounds: Array) -> NDArray[np.intp]:
    count = min(BOXES_AT_ONCE, len(bounds))
    return np.argpartition(bounds, count - 1)[:count]


def _halves(low: Array, high: Array, values: Array, cuts: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Both halves of every box that is to be cut."""
    kept = cuts >= 0
    low, high, values, cuts = low[kept], high[kept], values[kept], cuts[kept]
    rows = np.arange(len(values))
    first, last = low[rows, cuts], high[rows, cuts]
    middle = 0.5 * first + 0.5 * last
    # A range over several octaves, a gain's above all, is cut in the middle of its logarithm.
    ratio = np.divide(last, first, out=np.ones_like(first), where=first * last > 0.0)
    wide = np.abs(np.log(ratio)) > OCTAVE
    middle = np.where(wide, np.sign(last) * np.sqrt(np.maximum(first * last, 0.0)), middle)
    upper_low, lower_high = low.copy(), high.copy()
    upper_low[rows, cuts] = lower_high[rows, cuts] = middle
    return (
        np.concatenate([low, upper_low]),
        np.concatenate([lower_high, high]),
        np.concatenate([values, values]),
    )
