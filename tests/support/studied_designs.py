"""Designs as the studies of the shipped requirements wrote them: the four winners, both families, all folding pairs,
all combinations of gain signs."""

import json
from functools import cache
from typing import Any

from designer.design import Design
from support import DATA

_RECORDS: list[dict[str, Any]] = json.loads((DATA / "studied_designs.json").read_text(encoding="utf-8"))
NAMES = tuple(f"{record['requirement']}:{record['configuration']}" for record in _RECORDS)


@cache
def studied_design(name: str) -> Design:
    """The design of that requirement and configuration."""
    return Design.model_validate(_RECORDS[NAMES.index(name)])


_SHARP: list[dict[str, Any]] = json.loads((DATA / "sharp_designs.json").read_text(encoding="utf-8"))
SHARP_NAMES = tuple(f"{record['requirement']}:{record['configuration']}" for record in _SHARP)
"""Designs that studies found sharp through their own lens, best first: families, folding pairs, signs as above."""


@cache
def sharp_design(name: str) -> Design:
    """The sharp design of that requirement and configuration."""
    return Design.model_validate(_SHARP[SHARP_NAMES.index(name)])


def with_coarse_pixels(design: Design, factor: int) -> Design:
    """The same optics over a sensor with fewer, larger pixels."""
    camera = design.camera
    circle = camera.image_circle_radius_px
    coarse = camera.model_copy(
        update={
            "width_px": camera.width_px // factor,
            "height_px": camera.height_px // factor,
            "pixel_pitch_mm": camera.pixel_pitch_mm * factor,
            "image_circle_radius_px": circle and circle / factor,
        }
    )
    return design.model_copy(update={"camera": coarse})
