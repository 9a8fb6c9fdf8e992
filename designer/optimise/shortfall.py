"""What stands in the way of a configuration without a feasible design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.optimise.constraints import FIXED
from designer.optimise.multistart import Candidate

# Violations within this share of the largest are as large.
TIED = 1e-3


@dataclass(frozen=True, slots=True)
class Shortfall:
    """A constraint that fails most at the point of least largest violation, the first by name, in its own unit."""

    constraint: str
    amount: float
    unit: str
    scaled: float
    variant: str


def shortfalls_of(miss: Candidate) -> list[Shortfall]:
    """The constraints that fail most, by name: several tie where the largest violation is least, in no fixed order."""
    evaluation, variant = miss.evaluation, miss.problem.variant.label
    failing = np.flatnonzero(evaluation.violations[:, 0] >= (1.0 - TIED) * evaluation.violations[:, 0].max())
    # A constraint on both ends of a zone has one name for the two.
    amounts = {}
    for index in failing:
        name, amount, unit = evaluation.names[index], float(evaluation.amounts[index, 0]), evaluation.units[index]
        if name.startswith(FIXED):
            side = "too high" if amount > 0.0 else "too low"
            unit = f"{side} {unit}" if unit.startswith("(") else f"{unit} {side}"
        amounts[name] = (abs(amount), unit)
    return [Shortfall(name, *amounts[name], miss.violation, variant) for name in sorted(amounts)]
