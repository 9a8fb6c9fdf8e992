"""How to set a design's lens, in words: focus, stop, the blur that is left, and the depth of field."""

from __future__ import annotations

import math
from collections.abc import Iterable

from designer.design import VIEW_NAMES, Design
from designer.evaluate.focus import focus_score
from designer.evaluate.through_focus import blur_limit_deg, depth_of_field_of_design
from designer.report.figures.style import length_unit
from designer.requirement.camera import Lens
from designer.typesetting.markup import number, plain_number, text


def lens_sentences(design: Design) -> str:
    """How to focus and stop down a design's lens, what blur is left in each view, and its depth of field; markup."""
    score = focus_score(design)
    if score is None:
        return ""
    at = "at infinity" if score.focus_distance_mm is None else f"at {number(score.focus_distance_mm, 0)} mm"
    blurs = [
        f"{number(score.largest_blur_deg_of_views[name], 2)}° ({number(score.largest_blur_px_of_views[name], 1)} px) "
        f"in the {name} view"
        for name in VIEW_NAMES
    ]
    return text(
        f"Focus {at} and stop down to f/{plain_number(round(score.f_number, 2))}. The largest "
        f"blur over the working volume is then {' and '.join(blurs)}; both views are sharp "
        f"(within {plain_number(blur_limit_deg(design))}°) {depth_of_field_words(design)}."
    )


def depth_of_field_words(design: Design) -> str:
    """The distances at which both views are sharp at every elevation, as the end of a sentence."""
    ends = depth_of_field_of_design(design)
    if ends is None:
        return "together at no distance"
    unit_mm, unit = length_unit(design.working_volume.distance_mm[1])
    near, far = (float(f"{end / unit_mm:.3g}") for end in ends)
    return f"from {plain_number(near)} {unit} " + (
        "to infinity" if math.isinf(far) else f"to {plain_number(far)} {unit}"
    )


def other_projections(lenses: Iterable[Lens]) -> str:
    """What replaces the method's formulas for lenses that are not perspective; nothing without one."""
    if all(lens.image_law.is_perspective for lens in lenses):
        return ""
    return (
        "== Other projections\n"
        "The formulas above are those of a perspective lens, $r = f tan psi$. With a lens of this requirement that has "
        "another projection or distortion, $r$ follows its law; $abs(d r \\/ d phi) = (d r \\/ d psi) sin psi "
        "\\/ cos phi$; a scale error shifts a slope by $r \\/ ((d r \\/ d psi) sin psi)$ in the place of $cos psi$; "
        "the limit takes, at each elevation, the best of all angles up to that of the largest gain; and the blur on "
        "the sensor is an ellipse, that of the perspective lens stretched by the law along and across the radius, of "
        "which the larger diameter is given (section 10 of the theory in the designer's documentation).\n"
    )
