"""Problems and designs that proofs are tried on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from designer.configurations import Configuration
from designer.optimise.multistart import Candidate
from designer.optimise.search import search
from designer.requirement import Requirement, read_requirement, set_key

CONFIGS = Path(__file__).parents[2] / "configs"


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


@pytest.fixture(scope="session")
def found() -> Found:
    """The best design of a direct configuration of the pipe's requirement, by its first stage."""
    asked = requirement_of("pipe_inspection")
    configuration = configuration_of(asked, "direct-HyHy-upper_outer")
    first = search(asked, configuration).first
    assert first is not None
    return Found(asked, configuration, first)
