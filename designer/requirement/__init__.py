"""What an engineer asks for: the requirement, its file, and the reference page of its keys."""

from designer.requirement.model import (
    Camera,
    Envelope,
    Fixed,
    FixedMirror,
    FixedView,
    Goal,
    Lens,
    Manufacture,
    Objective,
    Requirement,
    Solve,
    WorkingVolume,
    principal_distance,
)
from designer.requirement.reading import read_requirement, requirement_to_toml, set_key

__all__ = [
    "Camera",
    "Envelope",
    "Fixed",
    "FixedMirror",
    "FixedView",
    "Goal",
    "Lens",
    "Manufacture",
    "Objective",
    "Requirement",
    "Solve",
    "WorkingVolume",
    "principal_distance",
    "read_requirement",
    "requirement_to_toml",
    "set_key",
]
