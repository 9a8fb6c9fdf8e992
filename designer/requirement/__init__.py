"""What an engineer asks for: the requirement, its file, and the reference page of its keys."""

from designer.requirement.camera import Camera, Lens
from designer.requirement.fixed import Fixed, FixedMirror, FixedView
from designer.requirement.housing import Housing
from designer.requirement.manufacture import Manufacture
from designer.requirement.model import PREDICTED, SAME_OBJECTIVE, Objective, Requirement, Solve
from designer.requirement.reading import (
    NOT_ASKED,
    index_in,
    read_named_part,
    read_requirement,
    requirement_from_json,
    requirement_to_json,
    requirement_to_toml,
    set_key,
)
from designer.requirement.space import Envelope, WorkingVolume

__all__ = [
    "NOT_ASKED",
    "PREDICTED",
    "SAME_OBJECTIVE",
    "Camera",
    "Envelope",
    "Fixed",
    "FixedMirror",
    "FixedView",
    "Housing",
    "Lens",
    "Manufacture",
    "Objective",
    "Requirement",
    "Solve",
    "WorkingVolume",
    "index_in",
    "read_named_part",
    "read_requirement",
    "requirement_from_json",
    "requirement_to_json",
    "requirement_to_toml",
    "set_key",
]
