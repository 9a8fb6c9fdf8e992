"""Designs that studies found for the robot's requirement with lenses that are not r = f tan(psi), one for each law."""

import json
from functools import cache
from typing import Any

from designer.design import Design
from support import DATA

_RECORDS: list[dict[str, Any]] = json.loads((DATA / "wide_designs.json").read_text(encoding="utf-8"))
LAWS = tuple(
    record["camera"].get("projection", "perspective") + ("+distortion" if "distortion" in record["camera"] else "")
    for record in _RECORDS
)


@cache
def wide_design(law: str) -> Design:
    """The design with that law."""
    return Design.model_validate(_RECORDS[LAWS.index(law)])
