"""What mirrors are made of and coated with, unless somebody decides otherwise: two short tables.

Reflectivities are means over the visible, near normal incidence, of the kind that vendors guarantee: a coater's own
curve decides. The requirement's ``[light] mirror_reflectivity`` is what a study counts with.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Coating:
    """A reflecting coating and the share of the light that it reflects, and why one would choose it."""

    name: str
    reflectivity: float
    reason: str


@dataclass(frozen=True, slots=True)
class BlankMaterial:
    """What a blank is made of, and how its face is made."""

    name: str
    process: str


COATINGS = (
    Coating("protected aluminium", 0.85, "can be wiped"),
    Coating("protected silver", 0.97, "most light, ages in damp air"),
    Coating("bare aluminium", 0.88, "as turned, cannot be wiped"),
)
"""The default comes first."""

ALUMINIUM_6061 = BlankMaterial("aluminium EN AW-6061", "diamond-turned")
