"""What a running study tells whoever started it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a study has come, sent after each configuration.

    ``configuration`` and ``status`` belong to the one just finished; ``feasible`` counts all so far.
    """

    done: int
    total: int
    configuration: str
    status: str
    feasible: int
    elapsed_seconds: float
    remaining_seconds: float
