"""Shipped requirements with other numbers, and what a search finds for them: what proofs are tried on."""

from __future__ import annotations

from dataclasses import dataclass

from designer.configurations import Configuration
from designer.optimise.multistart import Candidate
from designer.requirement import Requirement, read_requirement, set_key
from support import CONFIGS


def requirement_of(name: str, **keys: object) -> Requirement:
    """A shipped requirement with some keys set; two underscores stand for a dot."""
    asked = read_requirement(CONFIGS / f"{name}.toml")
    for key, value in keys.items():
        asked = set_key(asked, key.replace("__", "."), value)
    return asked


def configuration_of(asked: Requirement, name: str) -> Configuration:
    return next(each for each in asked.configurations if each.name == name)


@dataclass(frozen=True)
class Found:
    requirement: Requirement
    configuration: Configuration
    design: Candidate
