"""Compiled loops where Numba is installed (the extra ``compiled``); NumPy does the same work, only more slowly."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType

from designer.extras import is_installed


@cache
def compiled_loops(name: str) -> ModuleType | None:
    """A module of this room that needs Numba; None without Numba."""
    return import_module(f"designer.imaging.render.{name}") if is_installed("compiled") else None
