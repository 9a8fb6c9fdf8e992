"""Designs that studies found with lenses that are not r = f tan(psi): for the robot, one folded pair for each law, and
for the ceiling a direct one with a gain of either sign."""

import json
from functools import cache
from typing import Any

from designer.design import Design
from support import DATA

_RECORDS: list[dict[str, Any]] = json.loads((DATA / "wide_designs.json").read_text(encoding="utf-8"))
LAWS = tuple(
    record["camera"].get("projection", "perspective")
    + ("+distortion" if "distortion" in record["camera"] else "")
    + (", direct" if record["configuration"].startswith("direct") else "")
    for record in _RECORDS
)


@cache
def wide_design(law: str) -> Design:
    """The design with that law."""
    return Design.model_validate(_RECORDS[LAWS.index(law)])
