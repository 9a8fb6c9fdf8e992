"""Designs for the imaging tests: only their views matter here, so any signs of gain and senses can be combined."""

from functools import cache
from itertools import product

import numpy as np

from designer.design import Design, read_design
from designer.optics.view import half_angle_tangent
from support import DATA

SIGNS = tuple(product((1.0, -1.0), repeat=2))
SENSES = tuple(product(("direct", "folded"), repeat=2))


@cache
def prototype() -> Design:
    """The paper's prototype: 1600 x 1200 pixels, baseline 100 mm, 16 degrees up and down at 1 to 5 m."""
    return read_design(DATA / "folded_hypl_hy.json")


@cache
def coarse_prototype() -> Design:
    """The prototype with pixels twice as large."""
    camera = prototype().camera.model_copy(update={"width_px": 800, "height_px": 600, "pixel_pitch_mm": 0.0088})
    return prototype().model_copy(update={"camera": camera})


def with_views(
    design: Design, signs: tuple[float, float] = (1.0, 1.0), senses: tuple[str, str] | None = None
) -> Design:
    """The design with the upper and lower gain's signs, and their senses, replaced.

    A changed sense turns a zone inside out, so the gain is changed to keep its middle where it was.
    """
    views = {}
    for name, sign, sense in zip(("upper", "lower"), signs, senses or (None, None), strict=True):
        view = getattr(design.views, name)
        gain = view.gain
        if sense and sense != view.sense:
            middle = np.tan(np.radians(np.mean(view.elevation_deg)))
            gain *= half_angle_tangent(middle, view.sense) / half_angle_tangent(middle, sense)
        views[name] = view.model_copy(update={"gain": sign * float(gain), "sense": sense or view.sense})
    return design.model_copy(update={"views": design.views.model_copy(update=views)})
