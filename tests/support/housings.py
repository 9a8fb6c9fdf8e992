"""Designs in a tube or between struts, as tall as the light of both views needs."""

import math

from designer.design import Design
from designer.housing import Struts, Tube


def with_tube(design: Design, wall_mm: float = 3.0, refractive_index: float = 1.49, gap_mm: float = 1.0) -> Design:
    """The design in a tube that is ``gap_mm`` wider than its widest mirror, or than its lens."""
    low, high = _ends(design)
    inner = max(design.diameter_mm / 2.0, design.camera.lens_radius_mm) + gap_mm
    for view in design.views.by_name.values():
        for elevation in view.elevation_deg:
            rise = math.tan(math.radians(elevation)) * (inner + wall_mm)
            low, high = min(low, view.viewpoint_mm + rise - gap_mm), max(high, view.viewpoint_mm + rise + gap_mm)
    tube = Tube(
        kind="tube",
        inner_radius_mm=inner,
        wall_mm=wall_mm,
        refractive_index=refractive_index,
        material="acrylic",
        low_mm=low,
        high_mm=high,
    )
    size = {"diameter_mm": 2.0 * tube.outer_radius_mm, "height_mm": high - low}
    return design.model_copy(update={"housing": tube, **size})


def with_struts(design: Design, number: int = 3, width_mm: float = 4.0, gap_mm: float = 1.0) -> Design:
    """The design between struts that stand ``gap_mm`` outside its widest mirror."""
    low, high = _ends(design)
    radius = design.diameter_mm / 2.0 + gap_mm + width_mm / 2.0
    struts = Struts(kind="struts", number=number, width_mm=width_mm, radius_mm=radius, low_mm=low, high_mm=high)
    return design.model_copy(update={"housing": struts, "diameter_mm": 2.0 * struts.outer_radius_mm})


def _ends(design: Design) -> tuple[float, float]:
    """Lowest and highest point that count for the height of the mirrors alone."""
    from designer.evaluate.fabrication import size_of

    size = size_of(design.model_copy(update={"housing": None}))
    return float(size.bottom), float(size.top)
