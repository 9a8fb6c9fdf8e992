"""Solids of a built sensor that penetrate, against the judge's sections of designs whose parts stand elsewhere."""

from __future__ import annotations

import numpy as np

from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.trace.contact import built_contacts
from designer.verify.solids import contact_problems
from support.studied_designs import SHARP_NAMES, sharp_design


def pairs(sentences: list[str]) -> set[frozenset[str]]:
    """Who penetrates whom."""
    found = set()
    for sentence in sentences:
        one, _, rest = sentence.partition(" and ")
        found.add(frozenset((one, rest.partition(" penetrate")[0].removeprefix("the "))))
    return found


def test_shifted_mirrors_penetrate_what_the_judge_says() -> None:
    assert sum(penetrations(place) for place in (0, 4, 5, 7, 8)) > 15


def penetrations(place: int) -> int:
    """How many pairs penetrate, as both say, while one mirror after the other is shifted in steps."""
    thin = sharp_design(SHARP_NAMES[place])
    assert built_contacts(thin) == []
    # Thick enough to be met by the steps below.
    thick = tuple(mirror.model_copy(update={"thickness_mm": 9.0}) for mirror in thin.mirrors)
    design = thin.model_copy(update={"mirrors": thick})
    both = 0
    for mirror in design.mirrors:
        for shift in np.linspace(-49.0, 49.0, 13):
            departure = AsBuilt(mirrors={mirror.name: MirrorDeparture(axial_shift_mm=float(shift))})
            moved = mirror.model_copy(update={"vertex_mm": mirror.vertex_mm + shift})
            others = tuple(moved if other.name == mirror.name else other for other in design.mirrors)
            judged = pairs(contact_problems(design.model_copy(update={"mirrors": others})))
            assert pairs(built_contacts(design.model_copy(update={"as_built": departure}))) == judged
            both += len(judged)
    return both


def test_a_camera_that_moves_meets_what_a_mirror_that_moves_back_meets() -> None:
    design = sharp_design(SHARP_NAMES[0])
    near = AsBuilt(camera=CameraDeparture(axial_shift_mm=45.0))
    back = AsBuilt(mirrors={mirror.name: MirrorDeparture(axial_shift_mm=-45.0) for mirror in design.mirrors})
    found = [built_contacts(design.model_copy(update={"as_built": record})) for record in (near, back)]
    assert found[0] == found[1] != []
