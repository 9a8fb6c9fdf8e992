"""A design that proofs are tried on."""

from __future__ import annotations

import pytest

from designer.optimise.search import search
from support.proved import Found, configuration_of, requirement_of


@pytest.fixture(scope="session")
def found() -> Found:
    """The best design of a direct configuration of the pipe's requirement, by its first stage."""
    asked = requirement_of("pipe_inspection")
    configuration = configuration_of(asked, "direct-HyHy-upper_outer")
    first = search(asked, configuration).first
    assert first is not None
    return Found(asked, configuration, first)
