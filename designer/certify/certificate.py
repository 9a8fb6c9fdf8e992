"""What is proved about one configuration of a study."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from pydantic import JsonValue

from designer.files import as_json

Status = Literal["optimal", "gap", "infeasible", "not proven"]

SOLVER = "interval branch and bound of the designer"
# How far above the bound a design may be and still count as proven optimal.
SMALL_GAP = 0.01

KNOWN_RULES = (
    "ranges of focus, f-number and baseline; image circle and gap between the zones with the mixing of the light; "
    "lens barrel; sizes, slopes and vertex sheets of the mirrors; signs of the variant; nearest mirror; height and "
    "diameter; blur at the ends and the middle of both views; edges between the two zones"
)
"""The rules that a bound knows."""

UNKNOWN_RULES = "other clearances of light and solids; a housing; aliasing in the predicted noise"
"""What it leaves out, which can only make designs worse."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """What is proved about a configuration.

    Attributes
    ----------
    configuration
        Its name.
    status
        ``optimal``: no design is better by more than 1 %. ``gap``: none is better than the bound. ``infeasible``:
        no design keeps the rules. ``not proven``: neither was shown in the time given.
    depth_error_bound
        No design of the configuration has a smaller depth error (rms, as a share); None if not known.
    least_depth_error
        The least that the study found, in its first stage.
    gap_percent
        How far that is above the bound.
    design_gap_percent
        How far the study's design is above it, which has traded some of its depth error for the second objective.
    knows
        The rules that the bound knows; fewer are needed for a conflict.
    conflicting_keys
        Keys of the requirement of which no design keeps all.
    is_smallest
        Whether without any one of them no conflict could be proved any more.
    seconds
        Processor time.
    solver
        What proved it.
    why_not_proven
        Why there is no proof, or why the gap is not smaller.
    """

    configuration: str
    status: Status
    depth_error_bound: float | None = None
    least_depth_error: float | None = None
    gap_percent: float | None = None
    design_gap_percent: float | None = None
    knows: str = ""
    conflicting_keys: tuple[str, ...] = ()
    is_smallest: bool | None = None
    seconds: float = 0.0
    solver: str = SOLVER
    why_not_proven: str = ""

    def as_json(self) -> dict[str, JsonValue]:
        """The certificate as a JSON object."""
        return {field.name: as_json(getattr(self, field.name)) for field in fields(self)}
